//! What comes of many photos.

use super::graph::PhotoPair;
use crate::geometry::{Camera, Model, MultiViewKind};
use crate::pipeline::Crops;
use crate::report::Warning;
use crate::warp::Projection;
use crate::{Image, ImageView, InverseDepth, Mask, Stage, View};

/// One of the photos to stitch.
#[derive(Debug, Clone, Copy)]
pub struct Photo<'a> {
    /// The photo.
    pub image: ImageView<'a>,
    /// Its focal length in pixels, if known to about five per cent.
    pub focal: Option<f64>,
    /// Its camera, if known: then that of every photo has to be, with the focal length, and all stay as they are. The principal point
    /// is the middle of the photo.
    pub camera: Option<Camera>,
    /// Its depth, if known: inverse depth up to an affine change, or in the unit of the cameras that are given.
    pub depth: Option<&'a InverseDepth>,
}

impl<'a> Photo<'a> {
    /// A photo of which nothing else is known.
    pub fn new(image: ImageView<'a>) -> Self {
        Self { image, focal: None, camera: None, depth: None }
    }

    pub(super) fn view(&self) -> View<'a> {
        View { image: self.image, depth: self.depth }
    }
}

/// Whether a photo is in the picture, and if not, why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PhotoCode {
    /// It is in the picture.
    Used,
    /// It matches none of the others.
    NoMatches,
    /// It matches others, but not the group of the `reference`, or else the largest.
    OtherGroup,
    /// It matches others, but they do not determine its pose.
    NoPose,
    /// It looks so far to the side of the reference that it would be stretched out of shape.
    TooOblique,
    /// Nothing of it is visible from the reference.
    NotVisible,
}

impl PhotoCode {
    /// The stable code, the same in Rust and JavaScript.
    pub fn code(self) -> &'static str {
        match self {
            Self::Used => "used",
            Self::NoMatches => "no-matches",
            Self::OtherGroup => "other-group",
            Self::NoPose => "no-pose",
            Self::TooOblique => "too-oblique",
            Self::NotVisible => "not-visible",
        }
    }
}

/// What became of one photo.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotoReport {
    /// Whether it is in the picture, and if not, why.
    pub code: PhotoCode,
    /// Its camera; `None` if it has no place, and where homographies are the geometry.
    pub camera: Option<Camera>,
    /// Focal length in pixels, with a camera.
    pub focal: Option<f64>,
    /// The median error of its matches by the geometry, in pixels. `None` without a place.
    pub error: Option<f64>,
    /// What its red, green and blue were multiplied by in linear light, on average over the overlap with the photos before
    /// it. The picture's shadows may have been lifted after that.
    pub gains: [f64; 3],
    /// The smallest rectangle around what the picture could show of it: x and y of the top left, width, height, from the
    /// reference's top left pixel. `None` unless used.
    pub extent: Option<[i64; 4]>,
    /// Where its pixels belong; `None` unless used and [asked for](crate::pipeline::Options::output_depth).
    pub map: Option<PhotoMap>,
}

/// Where the pixels of a photo belong in the reference's own pixels, whatever the picture is shown on. Where the lens distorts, they are
/// those of both photos without that.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotoMap {
    /// From the photo to the reference.
    pub forward: Model,
    /// Back, by the reference's inverse depth.
    pub reverse: Model,
    /// The photo's inverse depth, in the unit of the models; `None` without parallax.
    pub depth: Option<InverseDepth>,
    /// The photo without the distortion of its lens, at the same scale and with the same middle; `None` without distortion.
    pub undistorted: Option<Image>,
}

/// The result of [`stitch_many`](super::stitch_many).
#[derive(Debug, Clone, PartialEq)]
pub struct StitchedMany {
    /// RGBA, alpha 255 where any photo is valid, 0 elsewhere; voids filled if asked for.
    pub image: Image,
    /// Which photo shows: 0 none, otherwise its index plus 1.
    pub labels: Mask,
    /// Pixels that photos reach, but none of them covers.
    pub voids: Mask,
    /// Position of the reference's top left pixel; of the rectangle around it if it is not shown on a plane.
    pub offset: (usize, usize),
    /// How large the picture is next to the reference: 1, or ½, ¼ … where memory did not suffice for more. Of a photo `reference` pixel (x, y) is then at
    /// (x + ½)·scale − ½ from [`offset`](Self::offset), on a plane; where the lens distorts to within a pixel.
    pub scale: f64,
    /// The photo in whose view all are shown.
    pub reference: usize,
    /// What they are shown on.
    pub projection: Projection,
    /// The radial distortion of all photos, 0 where none was found: what is at distance r from the middle, in diagonals of the photo, would be
    /// at r/(1 + k r²) without it (division model; Fitzgibbon, 2001).
    pub distortion: f64,
    /// Which geometry explains the photos.
    pub geometry: MultiViewKind,
    /// One per photo, in the order given.
    pub photos: Vec<PhotoReport>,
    /// The pairs of photos that were compared.
    pub pairs: Vec<PhotoPair>,
    /// How the picture can be cropped.
    pub crops: Crops,
    /// Reasons to doubt the result.
    pub warnings: Vec<Warning>,
    /// Milliseconds per stage, by the observer's clock.
    pub times: Vec<(Stage, f64)>,
}

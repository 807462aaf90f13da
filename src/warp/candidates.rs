//! Void region recovery (paper, section 3.2.2): where in the target the candidates for the pixels of the canvas lie, and
//! which of them are voids because the reverse model sends them elsewhere (equations 10 to 12).

use wide::{CmpGt, CmpLt, f32x4, i32x4};

use super::batch::{BATCH, Batch, Covered};
use super::canvas::Canvas;
use super::projection_surface::Rays;
use super::sample::{Tap, Taps};
use super::scene::Scene;
use super::{RELIABLE, WarpMode};
use crate::geometry::{Model, Undistortion};
use crate::lanes::LANES;
use crate::rect::diagonal;
use crate::{ImageView, InverseDepth};

/// A batch of candidates, in the order their pixels were found and laid out as they are computed: four by four.
pub(super) struct Candidates {
    fours: [Four; BATCH / LANES],
    count: usize,
}

/// What cells offer for four pixels, one to a lane.
#[derive(Clone, Copy)]
struct Four {
    /// Indices of the pixels of the canvas.
    at: i32x4,
    /// Indices of the pixels of the reference, −1 where it does not reach.
    index: i32x4,
    /// Where they are in the target: the index is −1 for a void, the nearest pixel −1 beyond the photo's end.
    taps: Taps,
    /// Not 0 where the cell is longer than the limit.
    stretched: i32x4,
    /// The squared distance from there of where the reverse model sends the reference pixel, over β² (paper, equations 10 and 11):
    /// both that and 1 times the same factor.
    distance: f32x4,
    one: f32x4,
}

/// One of them.
pub(super) struct Candidate<'a> {
    four: &'a Four,
    lane: usize,
}

impl Candidates {
    pub fn new() -> Self {
        const EMPTY: Four = Four {
            at: i32x4::ZERO,
            index: i32x4::ZERO,
            taps: Taps::NONE,
            stretched: i32x4::ZERO,
            distance: f32x4::ZERO,
            one: f32x4::ZERO,
        };
        Self { fours: [EMPTY; BATCH / LANES], count: 0 }
    }

    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = Candidate<'_>> {
        (0..self.count.min(BATCH)).map(|k| Candidate { four: &self.fours[k / LANES], lane: k % LANES })
    }
}

impl Candidate<'_> {
    /// Index of the pixel of the canvas.
    #[inline(always)]
    pub fn at(&self) -> usize {
        self.four.at.as_array_ref()[self.lane] as usize
    }

    /// Index of the pixel of the reference, beyond all where there is none.
    #[inline(always)]
    pub fn index(&self) -> usize {
        self.four.index.as_array_ref()[self.lane] as usize
    }

    /// Whether it is a void.
    #[inline(always)]
    pub fn void(&self) -> bool {
        self.four.taps.index.as_array_ref()[self.lane] < 0
    }

    /// Whether the photo does not reach there.
    #[inline(always)]
    pub fn beyond(&self) -> bool {
        self.four.taps.nearest.as_array_ref()[self.lane] < 0
    }

    /// Whether it is where it should be by β, the square of which is divided by `strictness`.
    #[inline(always)]
    pub fn near(&self, strictness: f32) -> bool {
        self.four.distance.as_array_ref()[self.lane] * strictness < self.four.one.as_array_ref()[self.lane]
    }

    /// Its confidence (see [`super::Warped`]), β² being divided by `strictness`.
    #[inline(always)]
    pub fn confidence(&self, strictness: f32) -> u8 {
        let distance = self.four.distance.as_array_ref()[self.lane] * strictness;
        let one = self.four.one.as_array_ref()[self.lane];
        // The conversions saturate.
        if distance < one {
            255 - (f32::from(255 - RELIABLE) * distance / one) as u8
        } else if self.four.stretched.as_array_ref()[self.lane] != 0 {
            0
        } else {
            (f32::from(RELIABLE - 1) * one / distance) as u8
        }
    }

    /// Where it is in the target.
    #[inline(always)]
    pub fn tap(&self) -> Tap {
        self.four.taps.get(self.lane)
    }
}

/// Makes candidates of covered pixels.
pub(super) struct Locator<'a> {
    canvas: &'a Canvas,
    reference: (usize, usize),
    /// Masks, if there are any.
    mask: Option<ImageView<'a>>,
    reference_depth: Option<&'a [f32]>,
    target: (usize, usize),
    lens: Option<LensLanes>,
    /// Width and height of a cell in target pixels.
    step: [f32x4; 2],
    reverse: ModelLanes,
    /// Those of the reference's pixels, unless it is projected onto a plane.
    rays: Option<Rays>,
    /// Whether there are voids outside the reference, and in the overlap.
    recover: [bool; 2],
    /// 1/β², β in pixels of the target.
    per_place: f32,
}

impl<'a> Locator<'a> {
    pub fn new(scene: &Scene<'a>, canvas: &'a Canvas, step: [f64; 2]) -> Self {
        let size = scene.target.size();
        let (w, h, place) = (size.0 as f64, size.1 as f64, scene.options.void_distance);
        Self {
            canvas,
            reference: scene.reference.size(),
            mask: Some(scene.reference).filter(ImageView::is_masked),
            reference_depth: scene.reference_depth.map(InverseDepth::data),
            target: size,
            lens: scene.distorted.map(|distorted| LensLanes::new(&distorted.lens)),
            step: step.map(|step| f32x4::splat(step as f32)),
            reverse: ModelLanes::new(scene.reverse),
            rays: scene.surface.map(|surface| surface.rays([0.0; 2], scene.reference.size())),
            recover: match scene.options.mode {
                WarpMode::Backward => [false; 2],
                WarpMode::Soft => [true, false],
                _ => [true; 2],
            },
            per_place: (1.0 / (place * place * (w * w + h * h))) as f32,
        }
    }

    /// Looks at the pixels covered by cells of row `j`.
    #[inline(always)]
    pub fn locate(&self, covered: &Batch, j: usize, out: &mut Candidates) {
        let (offset_x, offset_y) = self.canvas.offset;
        let shift = i32x4::splat((offset_y * self.canvas.width + offset_x) as i32);
        let stride = i32x4::splat(self.canvas.width as i32);
        let (width, height) = (i32x4::splat(self.reference.0 as i32), i32x4::splat(self.reference.1 as i32));
        let before = i32x4::splat(-1);
        for (k, Covered { x, y, u, v, stretched }) in covered.fours().enumerate() {
            let mut inside = x.cmp_gt(before) & x.cmp_lt(width) & y.cmp_gt(before) & y.cmp_lt(height);
            let index = y * width + x;
            if let Some(mask) = &self.mask {
                inside &= there(mask, index & inside);
            }
            let s = [u * self.step[0], (f32x4::splat(j as f32) + v) * self.step[1]];
            let (mut distance, mut one) = (f32x4::ZERO, f32x4::ONE);
            let mut kept = !i32x4::ZERO;
            if self.recover[0] {
                kept = !(inside | stretched);
                // Mostly all four are on the same side.
                if inside.move_mask() != 0 {
                    let index = index & inside;
                    let depth = |lane: usize| {
                        self.reference_depth.map_or(0.0, |depth| depth[index.as_array_ref()[lane] as usize])
                    };
                    let place = match &self.rays {
                        Some(rays) => along(rays, x & inside, y & inside),
                        None => [f32x4::from_i32x4(x), f32x4::from_i32x4(y), f32x4::ONE],
                    };
                    let [u, v, w] = self.reverse.transform(place, f32x4::new([depth(0), depth(1), depth(2), depth(3)]));
                    let (dx, dy) = (u - s[0] * w, v - s[1] * w);
                    (distance, one) = ((dx * dx + dy * dy) * self.per_place, w * w);
                    let in_front = w.cmp_gt(f32x4::ZERO);
                    if self.recover[1] {
                        let near: i32x4 = bytemuck::cast(in_front & distance.cmp_lt(one));
                        kept |= inside & near;
                    } else {
                        // What is behind the camera is nowhere near; outside there is nothing to compare.
                        let within: f32x4 = bytemuck::cast(inside);
                        distance = within & distance;
                        one = within.blend(in_front & one, f32x4::ONE);
                        kept |= inside;
                    }
                }
            }
            let mut taps = Taps::new(s, self.target);
            if let Some(lens) = &self.lens {
                lens.distort(s, &mut taps);
            }
            taps.index |= !kept;
            out.fours[k] = Four { at: y * stride + x + shift, index: index | !inside, taps, stretched, distance, one };
        }
        out.count = covered.count;
    }
}

/// Which of four pixels are not masked.
fn there(image: &ImageView<'_>, index: i32x4) -> i32x4 {
    i32x4::new(
        index
            .to_array()
            .map(|i| -i32::from(image.pixels().get(i as usize).is_some_and(|&pixel| image.is_there(pixel)))),
    )
}

/// The rays of four pixels.
fn along(rays: &Rays, x: i32x4, y: i32x4) -> [f32x4; 3] {
    let (x, y) = (x.to_array(), y.to_array());
    let four = [0, 1, 2, 3].map(|lane| rays.at(x[lane] as usize, y[lane] as usize));
    [0, 1, 2].map(|k| f32x4::new(four.map(|ray| ray[k])))
}

/// The distortion of a lens in single precision, for four points at once.
struct LensLanes {
    /// −4k over the squared diagonal.
    bent: f32,
    /// The middle of the target's frame, and of the photo.
    middle: [[f32; 2]; 2],
    photo: (usize, usize),
}

impl LensLanes {
    fn new(lens: &Undistortion) -> Self {
        let middle = |(w, h): (usize, usize)| [w, h].map(|side| 0.5 * (side as f32 - 1.0));
        let unit = diagonal(lens.photo);
        let bent = (-4.0 * lens.distortion.0 / (unit * unit)) as f32;
        Self { bent, middle: [middle(lens.frame), middle(lens.photo)], photo: lens.photo }
    }

    /// Where places of the target are in the photo, as [`Undistortion::distort`]; the nearest pixels stay those of the target.
    #[inline(always)]
    fn distort(&self, place: [f32x4; 2], taps: &mut Taps) {
        let [from, to] = self.middle;
        let off = [place[0] - f32x4::splat(from[0]), place[1] - f32x4::splat(from[1])];
        let square = off[0] * off[0] + off[1] * off[1];
        let root = (f32x4::ONE + square * self.bent).fast_max(f32x4::ZERO).sqrt();
        let factor = f32x4::splat(2.0) / (f32x4::ONE + root);
        let (mut within, mut places) = (!i32x4::ZERO, place);
        for (k, side) in [self.photo.0, self.photo.1].into_iter().enumerate() {
            let (p, last) = (off[k] * factor + f32x4::splat(to[k]), f32x4::splat(side as f32 - 1.0));
            let half = f32x4::splat(0.5);
            within &= bytemuck::cast::<_, i32x4>(p.cmp_gt(-half) & p.cmp_lt(last + half));
            places[k] = p.fast_max(f32x4::ZERO).fast_min(last);
        }
        let nearest = taps.nearest;
        *taps = Taps::new(places, self.photo);
        taps.nearest = nearest | !within;
    }
}

/// A model in single precision, for four points at once.
struct ModelLanes([[f32; 4]; 3]);

impl ModelLanes {
    fn new(model: &Model) -> Self {
        let row = |i: usize| [model.h[(i, 0)], model.h[(i, 1)], model.h[(i, 2)], model.e[i]].map(|v| v as f32);
        Self([row(0), row(1), row(2)])
    }

    /// As [`Model::transform`], of homogeneous coordinates.
    #[inline(always)]
    fn transform(&self, [x, y, z]: [f32x4; 3], d: f32x4) -> [f32x4; 3] {
        let row = |[a, b, c, e]: [f32; 4]| x * a + y * b + d * e + z * c;
        [row(self.0[0]), row(self.0[1]), row(self.0[2])]
    }
}

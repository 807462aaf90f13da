//! Warnings: what a person should know about a result that is not an error.

use crate::decimal::Decimal;

/// A warning about a result. The code is stable, the text is for people.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// At least one depth map is missing, so a homography was fitted.
    NoDepth,
    /// A depth map does not explain the parallax of the matches, and was ignored.
    DepthInconsistent,
    /// The depth maps have no value at enough matches, and were ignored.
    DepthUnusable {
        /// Matches with depth in both maps.
        usable: usize,
    },
    /// Planar scene, pure rotation or constant depth: the homography explains the matches as well.
    ParallaxUnobservable,
    /// Two photos alone: what only the target shows was not measured, and bends back to a plane of the scene.
    OutsideExtrapolated,
    /// No depth maps: with the depth that was found the picture would bend or tear where one photo alone shows, so it is done without parallax.
    ParallaxIgnored,
    /// The model rests on few inliers.
    FewInliers {
        /// How many.
        inliers: usize,
    },
    /// Most matches disagree with the model.
    LowInlierRatio {
        /// Inliers over usable matches.
        ratio: f64,
    },
    /// The narrow threshold found no strong consensus; a wider one was used.
    ThresholdWidened {
        /// The one used, in pixels.
        threshold: f64,
    },
    /// The picture is smaller than the photos, which memory would not have sufficed for.
    ReducedResolution {
        /// Its size next to theirs: ½, ¼ …
        scale: f64,
    },
    /// Part of the warped target lies beyond the canvas limit and was cut off.
    CanvasClipped,
    /// The photos differ where the model says they should agree.
    PoorAlignment {
        /// SSIM over the overlap.
        ssim: f64,
    },
    /// The overlap covers little of the reference.
    SmallOverlap {
        /// Share of the reference.
        coverage: f64,
    },
}

impl Warning {
    /// The stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Warning::NoDepth => "no-depth",
            Warning::DepthInconsistent => "depth-inconsistent",
            Warning::DepthUnusable { .. } => "depth-unusable",
            Warning::ParallaxUnobservable => "parallax-unobservable",
            Warning::OutsideExtrapolated => "outside-extrapolated",
            Warning::ParallaxIgnored => "parallax-ignored",
            Warning::FewInliers { .. } => "few-inliers",
            Warning::LowInlierRatio { .. } => "low-inlier-ratio",
            Warning::ThresholdWidened { .. } => "threshold-widened",
            Warning::ReducedResolution { .. } => "reduced-resolution",
            Warning::CanvasClipped => "canvas-clipped",
            Warning::PoorAlignment { .. } => "poor-alignment",
            Warning::SmallOverlap { .. } => "small-overlap",
        }
    }

    /// One sentence for a person.
    pub fn message(&self) -> String {
        match self {
            Warning::NoDepth => "Depth maps are missing: the photos are aligned by a homography.".into(),
            Warning::DepthInconsistent => {
                "The depth maps do not explain how the photos differ: at least one of them was ignored.".into()
            }
            Warning::DepthUnusable { usable } => {
                format!("Only {usable} matches have depth in both maps: the depth maps were ignored.")
            }
            Warning::ParallaxUnobservable => {
                "The matches show no parallax (flat scene, pure rotation or constant depth): the photos are aligned by a homography.".into()
            }
            Warning::OutsideExtrapolated => {
                "The depth of what only the target shows is extrapolated: that part is aligned like one plane of the scene.".into()
            }
            Warning::ParallaxIgnored => {
                "With its depth what one photo alone shows would look distorted: the photos are aligned without parallax.".into()
            }
            Warning::FewInliers { inliers } => format!("Only {inliers} matches support the geometry: check the result carefully."),
            Warning::LowInlierRatio { ratio } => {
                format!("Only {} % of the matches agree with the geometry: check the result carefully.", Decimal(100.0 * ratio, 0))
            }
            Warning::ThresholdWidened { threshold } => {
                format!("Too few matches agreed closely: the geometry was fitted with a tolerance of {} px.", Decimal(*threshold, 1))
            }
            Warning::ReducedResolution { scale } => {
                format!("The picture is made at 1/{} of the photos' width and height: more would take more memory than is allowed.", Decimal(1.0 / scale, 0))
            }
            Warning::CanvasClipped => "Part of the warped target lies beyond the canvas limit and was cut off.".into(),
            Warning::PoorAlignment { ssim } => format!("The photos hardly agree where they overlap (SSIM {}).", Decimal(*ssim, 2)),
            Warning::SmallOverlap { coverage } => {
                format!("The warped target covers only {} % of the reference.", Decimal(100.0 * coverage, 1))
            }
        }
    }
}

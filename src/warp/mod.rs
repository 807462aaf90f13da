//! Optimal image warping (paper, section 3.2).

use crate::{Image, Mask};

/// How the target is rendered into the reference's view (paper, table 2, rows 3, 4, 5 and 8).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WarpMode {
    /// Every target pixel is put on the nearest canvas pixel.
    Forward,
    /// Every cell is drawn.
    Backward,
    /// Cells, with void recovery.
    BackwardVoid,
    /// Cells, with void recovery and overlapped-pixel selection.
    #[default]
    Optimal,
}

/// The target as the reference's camera would see it, on a canvas that holds both photos.
#[derive(Debug, Clone, PartialEq)]
pub struct Warped {
    /// The canvas: RGBA, alpha 255 where the target is visible, 0 elsewhere.
    pub image: Image,
    /// Where any cell of the target was drawn, voided ones included.
    pub footprint: Mask,
    /// Canvas position of the reference's top left pixel.
    pub offset: (usize, usize),
    /// Whether part of the target lay beyond the canvas limit.
    pub clipped: bool,
}

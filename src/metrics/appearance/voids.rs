//! Voids of the warped target within the reference.

use super::{inside, share};
use crate::rect::diagonal;
use crate::warp::Warped;
use crate::{Rect, Result};

/// Width of the band inside the reference's border, as a share of its diagonal.
const BAND: f64 = 0.02;

/// Shares of the target's footprint where it shows nothing, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Voids {
    /// In the band of 2 % of the diagonal inside the reference's border: where the seam has to pass.
    pub border: f64,
    /// In the whole reference.
    pub overlap: f64,
}

/// Voids within the reference, which lies at `frame` on the canvas.
///
/// # Errors
/// `size-mismatch` when masks or frame do not fit the canvas.
pub fn voids(warped: &Warped, frame: Rect) -> Result<Voids> {
    warped.check_frame(frame)?;
    let band = BAND * diagonal((frame.width, frame.height));
    let (mut drawn, mut void) = ([0; 2], [0; 2]);
    for y in frame.y..frame.y + frame.height {
        let row = y * warped.image.width();
        for x in frame.x..frame.x + frame.width {
            if warped.footprint.data()[row + x] == 0 {
                continue;
            }
            let empty = usize::from(warped.image.data()[4 * (row + x) + 3] == 0);
            let near = usize::from(inside(frame, x, y) as f64 <= band);
            (drawn[0], void[0]) = (drawn[0] + near, void[0] + near * empty);
            (drawn[1], void[1]) = (drawn[1] + 1, void[1] + empty);
        }
    }
    Ok(Voids { border: share(void[0], drawn[0]), overlap: share(void[1], drawn[1]) })
}

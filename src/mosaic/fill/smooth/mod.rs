//! Filling by coherence transport.
//!
//! After F. Bornemann and T. März, *Fast Image Inpainting Based on Coherence Transport*, J. Math. Imaging Vis. 28 (2007).
//! Void pixels are visited in order of their distance from the valid pixels around them, each once. A pixel becomes a
//! weighted mean of the known pixels around it; where the structure tensor finds an edge or a line there, the weights
//! are concentrated along it, so that it runs on into the void.

mod march;
mod transport;
mod window;

use super::Progress;
use crate::{Image, Mask, Result};
use transport::Transport;
use window::Window;

/// Filled pixels between two reports of progress.
const REPORT_EVERY: usize = 4096;

/// Fills the pixels of `voids` from their borders inwards; what `unknown` marks, which they are part of, tells nothing
/// about them. On an error `image` is untouched.
pub(super) fn fill(
    image: &mut Image,
    voids: &Mask,
    unknown: &Mask,
    radius: usize,
    progress: &mut Progress<'_>,
) -> Result<()> {
    let Some(window) = Window::around(voids, unknown, image, radius)? else { return Ok(()) };
    let order = march::order(&window)?;
    let mut transport = Transport::new(&window, image, radius, order.pixels.len())?;
    let (mut done, mut reported) = (0, 0);
    for front in order.fronts() {
        transport.advance(front);
        done += front.len();
        if done - reported >= REPORT_EVERY {
            reported = done;
            progress.report(done as f32 / order.pixels.len() as f32)?;
        }
    }
    transport.paint(&order.pixels, &window, image);
    Ok(())
}

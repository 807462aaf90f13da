//! Filling of the mosaic's inner voids by coherence transport.
//!
//! After F. Bornemann and T. März, *Fast Image Inpainting Based on Coherence Transport*, J. Math. Imaging Vis. 28 (2007).
//! Void pixels are visited in order of their distance from the valid pixels around them, each once. A pixel becomes a
//! weighted mean of the known pixels around it; where the structure tensor finds an edge or a line there, the weights
//! are concentrated along it, so that it runs on into the void.

mod march;
mod transport;
mod window;

use crate::image::check_len;
use crate::observer::{Observer, report};
use crate::{Error, Image, Mask, Result, Stage};
use transport::Transport;
use window::Window;

/// Options of [`fill`].
#[derive(Debug, Clone, PartialEq)]
pub struct FillOptions {
    /// Radius in pixels of the neighbourhood a filled pixel is drawn from, 1 to 64. Time grows with its square.
    pub radius: u32,
}

impl Default for FillOptions {
    fn default() -> Self {
        Self { radius: 5 }
    }
}

/// Filled pixels between two reports of progress.
const REPORT_EVERY: usize = 4096;

/// Fills the pixels of `voids` from their borders inwards and makes them opaque; all others stay as they are.
///
/// What `image` holds in a void is ignored, even if it is opaque. Void pixels that no path through the void joins
/// to a valid pixel (alpha not 0) cannot be filled: they stay as they are. On an error `image` is untouched.
///
/// # Errors
/// `invalid-argument` for a radius outside 1 to 64, `size-mismatch` when the mask is not the picture's size,
/// `out-of-memory`, `aborted`.
pub fn fill(image: &mut Image, voids: &Mask, options: &FillOptions, observer: &mut dyn Observer) -> Result<()> {
    check(image, voids, options)?;
    report(observer, Stage::Fill, 0.0)?;
    let radius = options.radius as usize;
    if let Some(window) = Window::around(voids, image, radius)? {
        let order = march::order(&window)?;
        let mut transport = Transport::new(&window, image, radius, order.pixels.len())?;
        let (mut done, mut reported) = (0, 0);
        for front in order.fronts() {
            transport.advance(front);
            done += front.len();
            if done - reported >= REPORT_EVERY {
                reported = done;
                report(observer, Stage::Fill, done as f32 / order.pixels.len() as f32)?;
            }
        }
        transport.paint(&order.pixels, &window, image);
    }
    report(observer, Stage::Fill, 1.0)
}

fn check(image: &Image, voids: &Mask, options: &FillOptions) -> Result<()> {
    check_len("image", image.data.len(), image.width, image.height, 4)?;
    check_len("voids", voids.data.len(), voids.width, voids.height, 1)?;
    for (name, expected, actual) in
        [("voids width", image.width, voids.width), ("voids height", image.height, voids.height)]
    {
        if expected != actual {
            return Err(Error::SizeMismatch { name, expected: expected as u64, actual: actual as u64 });
        }
    }
    if !(1..=64).contains(&options.radius) {
        let value = f64::from(options.radius);
        return Err(Error::InvalidArgument { name: "fillRadius", expected: "between 1 and 64 pixels", value });
    }
    Ok(())
}

//! Rectangles to crop the mosaic to.

use crate::image::{reserve, zeroed};
use crate::rect::{Rect, bounding_box, extent};
use crate::{Image, Result};

/// The largest axis-aligned rectangle of valid pixels only (alpha not 0).
///
/// Of several the topmost one, then the leftmost one. `None` when no pixel is valid.
///
/// In each row the valid pixels above every column are a histogram, whose largest rectangle a stack of rising columns
/// finds in one pass: time is proportional to the pixels, memory to a row.
///
/// ```
/// use depthstitch::mosaic::crop;
/// use depthstitch::{Image, Rect};
///
/// // A picture of 4×3 pixels whose top left corner is empty.
/// let mut pixels = [[90, 90, 90, 255]; 12];
/// pixels[0] = [0; 4];
/// let image = Image::new(pixels.concat(), 4, 3)?;
/// assert_eq!(crop::inner(&image)?, Some(Rect { x: 1, y: 0, width: 3, height: 3 }));
/// assert_eq!(crop::bounds(&image), Some(Rect { x: 0, y: 0, width: 4, height: 3 }));
/// # Ok::<(), Box<depthstitch::Error>>(())
/// ```
///
/// # Errors
/// `out-of-memory`.
pub fn inner(image: &Image) -> Result<Option<Rect>> {
    let mut heights: Vec<usize> = zeroed(image.width())?;
    let mut rising: Vec<(usize, usize)> = Vec::new(); // first column, height
    reserve(&mut rising, image.width())?;
    let mut best: Option<Rect> = None;
    for (y, row) in image.pixels().chunks_exact(image.width()).enumerate() {
        let mut turn = |x: usize, height: usize| {
            let mut first = x;
            while let Some(&(start, tall)) = rising.last().filter(|(_, tall)| *tall > height) {
                rising.pop();
                first = start;
                let found = Rect { x: start, y: y + 1 - tall, width: x - start, height: tall };
                if best.is_none_or(|best| precedes(&found, &best)) {
                    best = Some(found);
                }
            }
            if height > 0 && rising.last().is_none_or(|(_, tall)| *tall < height) {
                rising.push((first, height));
            }
        };
        let mut before = 0;
        for (x, (height, pixel)) in heights.iter_mut().zip(row).enumerate() {
            *height = if pixel[3] == 0 { 0 } else { *height + 1 };
            // Most columns are as high as the one before.
            if *height != before {
                turn(x, *height);
                before = *height;
            }
        }
        // A column of height 0 behind the last one closes all that are open.
        turn(image.width(), 0);
    }
    Ok(best)
}

/// Whether `a` is larger than `b`, or as large and before it.
fn precedes(a: &Rect, b: &Rect) -> bool {
    let (area, other) = (a.width * a.height, b.width * b.height);
    area > other || area == other && (a.y, a.x) < (b.y, b.x)
}

/// The smallest rectangle that holds all valid pixels (alpha not 0). `None` when no pixel is valid.
pub fn bounds(image: &Image) -> Option<Rect> {
    let row = |y: usize| {
        let row = &image.pixels()[y * image.width()..(y + 1) * image.width()];
        extent(row.iter().map(|pixel| pixel[3] != 0))
    };
    bounding_box(image.height(), &row)
}

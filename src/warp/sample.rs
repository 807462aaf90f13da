//! Bilinear sampling at one place of the target: its photo and its depth alike.

use crate::ImageView;

/// A place in the target between four pixels.
#[derive(Clone, Copy)]
pub(super) struct Tap {
    /// Index of the top left pixel of the four.
    index: usize,
    /// Steps to the right and to the lower neighbour; 0 in a picture one pixel wide or high.
    right: usize,
    down: usize,
    fx: f32,
    fy: f32,
}

impl Tap {
    /// The place (x, y) of a picture of the given size. Places outside move to the nearest pixel.
    #[inline(always)]
    pub fn new([x, y]: [f64; 2], (width, height): (usize, usize)) -> Self {
        // The last column and row are reached from the pixel before, so that the neighbours exist.
        let (last_x, last_y) = (width.saturating_sub(2), height.saturating_sub(2));
        let (ix, iy) = ((x as usize).min(last_x), (y as usize).min(last_y));
        Self {
            index: iy * width + ix,
            right: usize::from(width > 1),
            down: if height > 1 { width } else { 0 },
            fx: (x - ix as f64) as f32,
            fy: (y - iy as f64) as f32,
        }
    }

    /// RGB, 0 to 255; the fourth value is of no use.
    #[inline(always)]
    pub fn colour(&self, image: &ImageView<'_>) -> [f32; 4] {
        let pixels = image.pixels();
        let at = |index: usize| pixels[index].map(f32::from);
        let top = lerp(at(self.index), at(self.index + self.right), self.fx);
        let bottom = lerp(at(self.index + self.down), at(self.index + self.down + self.right), self.fx);
        lerp(top, bottom, self.fy)
    }

    /// A value of a map of the same size.
    #[inline(always)]
    pub fn value(&self, map: &[f32]) -> f32 {
        let at = |index: usize| map[index];
        let top = at(self.index) + self.fx * (at(self.index + self.right) - at(self.index));
        let below = self.index + self.down;
        let bottom = at(below) + self.fx * (at(below + self.right) - at(below));
        top + self.fy * (bottom - top)
    }
}

#[inline(always)]
fn lerp(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]), a[3] + t * (b[3] - a[3])]
}

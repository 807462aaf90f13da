//! Radial distortion of a lens, by the division model (Fitzgibbon, *Simultaneous linear estimation of multiple view geometry and lens
//! distortion*, 2001).

use crate::rect::diagonal;

/// The coefficient k: what is at distance r from the middle, in diagonals of the photo, would be at r/(1 + k r²) without distortion.
/// Below 0 it is a barrel, above a pincushion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Distortion(pub f64);

impl Distortion {
    /// The largest coefficient of either sign: no lens that projects onto a plane distorts by more.
    pub const MOST: f64 = 1.0;

    /// Where a place, from the middle in diagonals, would be without it.
    pub fn undistorted(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let factor = 1.0 / (1.0 + self.0 * (x * x + y * y));
        [x * factor, y * factor]
    }

    /// The derivative of [`Distortion::undistorted`] by the coefficient.
    pub fn slope(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let square = x * x + y * y;
        let denominator = 1.0 + self.0 * square;
        let factor = -square / (denominator * denominator);
        [x * factor, y * factor]
    }

    /// Where the lens shows what would be at a place without it.
    pub fn distorted(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let factor = 2.0 / (1.0 + (1.0 - 4.0 * self.0 * (x * x + y * y)).max(0.0).sqrt());
        [x * factor, y * factor]
    }
}

/// Between the pixels of a photo, and those of a larger or smaller frame that shows all of it without distortion at the same scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Undistortion {
    pub distortion: Distortion,
    /// The photo's width and height.
    pub photo: (usize, usize),
    /// The frame's.
    pub frame: (usize, usize),
}

impl Undistortion {
    pub fn of(photo: (usize, usize), distortion: Distortion) -> Self {
        let (w, h) = (photo.0 as f64, photo.1 as f64);
        // Of a barrel the corners are farthest out, of a pincushion the middles of the sides.
        let outermost = |side: f64| if distortion.0 < 0.0 { [0.5 * w, 0.5 * h] } else { [0.5 * side, 0.0] };
        let unit = 1.0 / diagonal(photo);
        // By as much on either side, so that the middles are the same pixel, or between the same.
        let grown = |side: f64| {
            let [x, y] = outermost(side).map(|p| p * unit);
            let beyond = 0.5 * (side / (1.0 + distortion.0 * (x * x + y * y)) - side);
            (side + 2.0 * beyond.ceil()) as usize
        };
        Self { distortion, photo, frame: (grown(w), grown(h)) }
    }

    /// From the photo to the frame, in pixels.
    pub fn undistort(&self, place: [f64; 2]) -> [f64; 2] {
        self.mapped(place, [self.photo, self.frame], |place| self.distortion.undistorted(place))
    }

    /// From the frame to the photo, in pixels.
    pub fn distort(&self, place: [f64; 2]) -> [f64; 2] {
        self.mapped(place, [self.frame, self.photo], |place| self.distortion.distorted(place))
    }

    fn mapped(&self, [x, y]: [f64; 2], sizes: [(usize, usize); 2], map: impl Fn([f64; 2]) -> [f64; 2]) -> [f64; 2] {
        let unit = diagonal(self.photo);
        let [from, to] = sizes.map(|(w, h)| [w, h].map(|side| 0.5 * (side as f64 - 1.0)));
        let [x, y] = map([(x - from[0]) / unit, (y - from[1]) / unit]);
        [x * unit + to[0], y * unit + to[1]]
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn every_pixel_has_its_place_in_the_frame_and_comes_back() {
        for coefficient in [-0.8, -0.1, 0.0, 0.05, 0.9] {
            let lens = Undistortion::of((640, 480), Distortion(coefficient));
            let (mut most, (width, height)) = ([0.0f64; 2], lens.frame);
            for place in [[0.0, 0.0], [639.0, 479.0], [639.0, 240.0], [320.0, 479.0], [100.5, 3.25]] {
                let [x, y] = lens.undistort(place);
                assert!(
                    x > -0.5 && y > -0.5 && x < width as f64 - 0.5 && y < height as f64 - 0.5,
                    "{coefficient}: {x} {y}"
                );
                let back = lens.distort([x, y]);
                assert!((0..2).all(|k| (back[k] - place[k]).abs() < 1e-9), "{coefficient}: {place:?} {back:?}");
                most = [most[0].max(x), most[1].max(y)];
            }
            // The frame is no larger than that.
            assert!(
                most[0] > width as f64 - 3.0 && most[1] > height as f64 - 3.0,
                "{coefficient}: {most:?} {:?}",
                lens.frame
            );
        }
    }

    #[test]
    fn the_slope_is_that_of_the_place() {
        let place = [0.3, -0.2];
        let [above, below] = [0.2 + 1e-6, 0.2 - 1e-6].map(|k| Distortion(k).undistorted(place));
        let slope = Distortion(0.2).slope(place);
        assert!((0..2).all(|k| ((above[k] - below[k]) / 2e-6 - slope[k]).abs() < 1e-8), "{slope:?}");
    }
}

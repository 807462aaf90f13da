//! CIE L*a*b* (D65) of sRGB, in which equal distances look about equally large.

use crate::srgb::linear_light;

/// L* is stretched to 0 to 255, as in pictures of 8 bit: a step in lightness is seen sooner than one in colour.
const LIGHTNESS: f32 = 2.55;

pub(super) struct Lab {
    linear: [f32; 256],
}

impl Lab {
    pub fn new() -> Self {
        Self { linear: linear_light() }
    }

    /// 2.55·L*, a*, b*.
    pub fn of(&self, [r, g, b, _]: [u8; 4]) -> [f32; 3] {
        let [r, g, b] = [r, g, b].map(|v| self.linear[usize::from(v)]);
        let [x, y, z] = [
            (0.412_453 * r + 0.357_580 * g + 0.180_423 * b) / 0.950_456,
            0.212_671 * r + 0.715_160 * g + 0.072_169 * b,
            (0.019_334 * r + 0.119_193 * g + 0.950_227 * b) / 1.088_754,
        ]
        .map(|t: f32| if t > 0.008_856 { libm::cbrtf(t) } else { 7.787 * t + 16.0 / 116.0 });
        [LIGHTNESS * (116.0 * y - 16.0), 500.0 * (x - y), 200.0 * (y - z)]
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn known_colours() {
        let lab = Lab::new();
        for (rgb, expected) in [
            ([0, 0, 0], [0.0, 0.0, 0.0]),
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([255, 0, 0], [53.24, 80.09, 67.20]),
            ([0, 0, 255], [32.30, 79.19, -107.86]),
            ([119, 119, 119], [50.03, 0.0, 0.0]),
        ] {
            let [l, a, b] = lab.of([rgb[0], rgb[1], rgb[2], 255]);
            for (got, expected) in [l / LIGHTNESS, a, b].into_iter().zip(expected) {
                assert!((f64::from(got) - expected).abs() < 0.1, "{rgb:?}: {got}, {expected}");
            }
        }
    }
}

//! Bilinear upsampling by 2.

/// Weight of the nearer one of two [`neighbours`], and of the farther one.
pub(crate) const WEIGHTS: [f32; 2] = [0.75, 0.25];

/// The samples at half the resolution, `len` of them, that sample `i` lies between: the nearer one and the farther one. Pixel
/// centres are mapped as areas, so `i` lies at (i + ½)/2 − ½. Beyond the border the samples there repeat.
pub(crate) fn neighbours(i: usize, len: usize) -> [usize; 2] {
    let near = i / 2;
    [near, if i.is_multiple_of(2) { near.saturating_sub(1) } else { (near + 1).min(len - 1) }]
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn a_ramp_stays_a_ramp() {
        let ramp = [0.0f32, 2.0, 4.0, 6.0];
        for i in 1..7 {
            let [near, far] = neighbours(i, ramp.len()).map(|k| ramp[k]);
            assert_eq!(WEIGHTS[0] * near + WEIGHTS[1] * far, i as f32 - 0.5);
        }
        assert_eq!(
            (neighbours(0, 4), neighbours(7, 4), neighbours(0, 1), neighbours(1, 1)),
            ([0, 0], [3, 3], [0, 0], [0, 0])
        );
    }
}

//! Elementary functions good enough for histograms, in plain arithmetic: the same bits natively and in wasm.

use wide::{CmpGt, CmpLt, f32x4};

/// Units of [`angle`] in a full turn: the orientation bins of a descriptor cell.
pub(super) const TURN: f32 = 8.0;

/// Direction of (x, y) in [0, [`TURN`]), within 10⁻⁵ radians; 0 of the zero vector. (M. Abramowitz and I. Stegun,
/// *Handbook of Mathematical Functions*, 4.4.49.)
#[inline(always)]
pub(super) fn angle(x: f32x4, y: f32x4) -> f32x4 {
    const RADIAN: f32 = TURN / (2.0 * std::f32::consts::PI);
    const ODD: [f32; 5] =
        [0.999_866 * RADIAN, -0.330_299_5 * RADIAN, 0.180_141 * RADIAN, -0.085_133 * RADIAN, 0.020_835_1 * RADIAN];
    let (ax, ay) = (x.abs(), y.abs());
    let (least, most) = (ax.fast_min(ay), ax.fast_max(ay));
    // Small enough to change no quotient, large enough that 0 / 0 is not taken.
    let z = least / most.fast_max(f32x4::splat(f32::MIN_POSITIVE));
    let zz = z * z;
    let [a, b, c, d, e] = ODD.map(f32x4::splat);
    let octant = z * (a + zz * (b + zz * (c + zz * (d + zz * e))));
    let zero = f32x4::splat(0.0);
    let quadrant = ay.cmp_gt(ax).blend(f32x4::splat(0.25 * TURN) - octant, octant);
    let half = x.cmp_lt(zero).blend(f32x4::splat(0.5 * TURN) - quadrant, quadrant);
    // The guard keeps what rounds up to a full turn below it.
    let full = f32x4::splat(TURN) - half;
    let full = full.fast_min(f32x4::splat(TURN - 1e-6));
    (y.cmp_lt(zero) & half.cmp_gt(zero)).blend(full, half)
}

/// Cosine and sine of an angle in [0, [`TURN`]], within 10⁻⁶.
pub(super) fn cos_sin(angle: f32) -> (f32, f32) {
    const RADIANS: f64 = 2.0 * std::f64::consts::PI / TURN as f64;
    // Within a quarter turn of the half turn's middle the Taylor series converge fast.
    let quadrant = (f64::from(angle) * (4.0 / f64::from(TURN)) + 0.5) as u32;
    let t = (f64::from(angle) - f64::from(quadrant) * f64::from(TURN / 4.0)) * RADIANS;
    let tt = t * t;
    let sin = t * (1.0 - tt / 6.0 * (1.0 - tt / 20.0 * (1.0 - tt / 42.0 * (1.0 - tt / 72.0))));
    let cos = 1.0 - tt / 2.0 * (1.0 - tt / 12.0 * (1.0 - tt / 30.0 * (1.0 - tt / 56.0)));
    let (cos, sin) = match quadrant % 4 {
        0 => (cos, sin),
        1 => (-sin, cos),
        2 => (-cos, -sin),
        _ => (sin, -cos),
    };
    (cos as f32, sin as f32)
}

/// out[i] = exp(−(first + i)²·falloff), by a recurrence that multiplies only.
pub(super) fn bell(first: f32, falloff: f32, out: &mut [f32]) {
    let (first, falloff) = (f64::from(first), f64::from(falloff));
    let mut value = libm::exp(-first * first * falloff);
    let mut ratio = libm::exp(-(2.0 * first + 1.0) * falloff);
    let step = libm::exp(-2.0 * falloff);
    for out in out {
        *out = value as f32;
        value *= ratio;
        ratio *= step;
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    const RADIANS: f64 = 2.0 * std::f64::consts::PI / TURN as f64;

    #[test]
    fn angle_is_that_of_atan2() {
        for i in 0..40_000 {
            let turn = f64::from(i) / 40_000.0 * std::f64::consts::TAU;
            let (x, y) = (libm::cos(turn) as f32 * 3.0, libm::sin(turn) as f32 * 3.0);
            let got = angle(f32x4::splat(x), f32x4::splat(y)).to_array()[2];
            assert!((0.0..TURN).contains(&got), "{turn}: {got}");
            let off = (f64::from(got) * RADIANS - turn).abs();
            assert!(off.min((off - std::f64::consts::TAU).abs()) < 2e-5, "{turn}: {got}");
        }
        for (x, y, expected) in [(0.0, 0.0, 0.0), (1.0, -0.0, 0.0), (-1.0, 0.0, 4.0), (0.0, -2.0, 6.0)] {
            assert_eq!(angle(f32x4::splat(x), f32x4::splat(y)).to_array()[0], expected);
        }
        assert!(angle(f32x4::splat(1.0), f32x4::splat(-1e-30)).to_array()[0] < TURN);
    }

    #[test]
    fn cos_sin_are_those_of_libm() {
        for i in 0..=8000 {
            let a = i as f32 / 1000.0;
            let (cos, sin) = cos_sin(a);
            let radians = f64::from(a) * RADIANS;
            assert!((f64::from(cos) - libm::cos(radians)).abs() < 1e-6, "{a}");
            assert!((f64::from(sin) - libm::sin(radians)).abs() < 1e-6, "{a}");
        }
    }

    #[test]
    fn bell_is_the_exponential() {
        let mut out = [0.0; 80];
        bell(-39.7, 1.0 / 800.0, &mut out);
        for (i, v) in out.iter().enumerate() {
            let x = -39.7 + i as f64;
            assert!((f64::from(*v) - libm::exp(-x * x / 800.0)).abs() < 1e-6);
        }
    }
}

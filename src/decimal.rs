//! Numbers in messages. The standard library's float formatting would be a tenth of the wasm module.

use std::fmt;

/// Shows a number with at most `1` digits after the point, without trailing zeros.
pub(crate) struct Decimal(pub f64, pub u32);

impl fmt::Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Decimal(value, digits) = *self;
        if value.is_nan() {
            return f.write_str("NaN");
        }
        if value.is_infinite() {
            return f.write_str(if value > 0.0 { "infinity" } else { "-infinity" });
        }
        let unit = 10u64.pow(digits);
        // Apart, as all digits of a large number would overflow.
        let whole = value.abs() as u64;
        let fraction = ((value.abs() - whole as f64) * unit as f64 + 0.5) as u64;
        let (whole, mut fraction) = (whole + fraction / unit, fraction % unit);
        if value < 0.0 && (whole > 0 || fraction > 0) {
            f.write_str("-")?;
        }
        write!(f, "{whole}")?;
        if fraction == 0 {
            return Ok(());
        }
        let mut width = digits as usize;
        while fraction % 10 == 0 {
            (fraction, width) = (fraction / 10, width - 1);
        }
        write!(f, ".{fraction:0width$}")
    }
}

/// Shows a number so that it can be told from others that would have been accepted: with at most 6 digits after the point, or as
/// many as tell it from an integer; the very large and the very small with an exponent.
pub(crate) struct Number(pub f64);

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mut number, mut exponent) = (self.0, 0);
        if number.is_finite() && number != 0.0 && !(1e-6..1e18).contains(&number.abs()) {
            // What would be shown as 10 is 1, times ten.
            while number.abs() >= 9.999_999_5 {
                (number, exponent) = (number / 10.0, exponent + 1);
            }
            while number.abs() < 0.999_999_95 {
                (number, exponent) = (number * 10.0, exponent - 1);
            }
            return write!(f, "{}e{exponent}", Decimal(number, 6));
        }
        let fraction = number.abs().fract();
        let (mut digits, mut half) = (6, 5e-7);
        while fraction > 0.0 && fraction.min(1.0 - fraction) < half {
            (digits, half) = (digits + 1, half / 10.0);
        }
        Decimal(number, digits).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::{Decimal, Number};

    #[test]
    fn numbers_read_as_a_person_writes_them() {
        let shown = |value, digits| Decimal(value, digits).to_string();
        assert_eq!(shown(3.0, 3), "3");
        assert_eq!(shown(-0.25, 3), "-0.25");
        assert_eq!(shown(12.0456, 2), "12.05");
        assert_eq!(shown(0.999, 2), "1");
        assert_eq!(shown(-0.001, 1), "0");
        assert_eq!(shown(f64::NAN, 1), "NaN");
        assert_eq!(shown(f64::NEG_INFINITY, 1), "-infinity");
        assert_eq!(shown(4_294_967_296.0, 3), "4294967296");
        assert_eq!(shown(30_000_000_000_000.5, 6), "30000000000000.5");
    }

    #[test]
    fn numbers_are_told_from_those_that_would_have_been_accepted() {
        for (value, expected) in [
            (0.0, "0"),
            (-0.25, "-0.25"),
            (0.1 + 0.2, "0.3"),
            (32.000_000_1, "32.0000001"),
            (-31.999_999_9, "-31.9999999"),
            (1.0 - f64::EPSILON, "0.9999999999999998"),
            (1e-6, "0.000001"),
            (1e-9, "1e-9"),
            (-2.5e-7, "-2.5e-7"),
            (5e-324, "4.940656e-324"),
            (1e15, "1000000000000000"),
            (1e18, "1e18"),
            (1e20, "1e20"),
            (-1.5e300, "-1.5e300"),
            (9.999_999_9e30, "1e31"),
            (f64::MAX, "1.797693e308"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "infinity"),
        ] {
            assert_eq!(Number(value).to_string(), expected);
        }
    }
}

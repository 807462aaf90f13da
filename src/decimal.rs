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
        let scaled = (value.abs() * unit as f64 + 0.5) as u64;
        if value < 0.0 && scaled > 0 {
            f.write_str("-")?;
        }
        write!(f, "{}", scaled / unit)?;
        let (mut fraction, mut width) = (scaled % unit, digits as usize);
        if fraction == 0 {
            return Ok(());
        }
        while fraction % 10 == 0 {
            (fraction, width) = (fraction / 10, width - 1);
        }
        write!(f, ".{fraction:0width$}")
    }
}

#[cfg(test)]
mod tests {
    use super::Decimal;

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
    }
}

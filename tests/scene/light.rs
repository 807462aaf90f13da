//! sRGB's transfer function and its inverse.

/// Linear light, 0 to 1, of a level.
pub fn linear(level: u8) -> f64 {
    let v = f64::from(level) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }
}

/// The level nearest to linear light.
pub fn level(light: f64) -> u8 {
    let v = if light <= 0.0031308 { 12.92 * light } else { 1.055 * libm::pow(light, 1.0 / 2.4) - 0.055 };
    (255.0 * v.clamp(0.0, 1.0)).round() as u8
}

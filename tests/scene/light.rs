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

/// Multiplies the light of a photo, which falls off towards the corners by a share.
pub fn take(rgba: &mut [u8], size: (usize, usize), gain: f64, falloff: f64) {
    let (w, h) = (size.0 as f64, size.1 as f64);
    for (i, pixel) in rgba.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        let (x, y) = ((i % size.0) as f64 - w / 2.0, (i / size.0) as f64 - h / 2.0);
        let gain = gain * (1.0 - falloff * 4.0 * (x * x + y * y) / (w * w + h * h));
        pixel[..3].iter_mut().for_each(|value| *value = level(gain * linear(*value)));
    }
}

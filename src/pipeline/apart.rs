//! What both photos show, and the alignment leaves apart: something that moved, or that is nearer than what is aligned.

use crate::Result;
use crate::image::reserve;

/// Closer than this, as a share of the diagonal, the seam can be left to how alike the photos are.
const LEAST: f64 = 0.01;
/// A match is one by chance unless so many others are near it, as a share of the diagonal, and as far apart in the same direction, up to
/// this part of the distance.
const SUPPORT: usize = 3;
const NEAR: f64 = 0.06;
const ALIKE: f64 = 0.2;

/// Of matches, given by where target and reference show them on the canvas, those that are apart; `diagonal` is that of the reference.
pub(super) fn apart(matches: impl Iterator<Item = [[f64; 2]; 2]>, diagonal: f64) -> Result<Vec<[[f64; 2]; 2]>> {
    let vector = |[[x, y], [u, v]]: [[f64; 2]; 2]| [u - x, v - y];
    let length = |[x, y]: [f64; 2]| (x * x + y * y).sqrt();
    let far: Vec<[[f64; 2]; 2]> = matches.filter(|pair| length(vector(*pair)) > LEAST * diagonal).collect();
    let mut found = Vec::new();
    reserve(&mut found, far.len())?;
    for pair in &far {
        let most = ALIKE * length(vector(*pair));
        let supports = |other: &&[[f64; 2]; 2]| {
            length(vector([pair[0], other[0]])) < NEAR * diagonal
                && length(vector([vector(*pair), vector(**other)])) < most
        };
        // Itself is one.
        if far.iter().filter(supports).count() > 0 {
            found.push(*pair);
        }
    }
    #[cfg(target_arch = "wasm32")]
    error(&format!("apart {} of {} {:?}", found.len(), far.len(), found.first()));
    Ok(found)
}
#[cfg(target_arch = "wasm32")]
#[wasm_bindgen::prelude::wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = process, js_name = _rawDebug)]
    pub fn error(s: &str);
}

//! The photos of a call and their depth maps, owned by the core for its length.

use wasm_bindgen::JsValue;

use super::convert::{get, size_from_js};
use super::inputs;
use crate::pipeline::{Job, check_inputs};
use crate::transparency::Extended;
use crate::{Image, InverseDepth, Result, View};

/// Both photos and their depth.
pub(super) struct Photos {
    target: Image,
    reference: Image,
    target_depth: Option<InverseDepth>,
    reference_depth: Option<InverseDepth>,
}

impl Photos {
    /// Copies the photos, and the depth maps among `inputs`. `check` may refuse the job before.
    pub fn read(
        target: &JsValue,
        reference: &JsValue,
        inputs: &JsValue,
        check: &dyn Fn(Job) -> Result<()>,
    ) -> Result<Self> {
        let target_size = size_from_js("target", target)?;
        let reference_size = size_from_js("reference", reference)?;
        let given = |name: &str| inputs::is_given(&get(inputs, name));
        check(Job {
            photos: [target_size, reference_size],
            depth: [given("targetDepth"), given("referenceDepth")],
            matches: given("matches"),
            // Not known before they are copied.
            masked: [false; 2],
        })?;
        Ok(Self {
            target: inputs::image("target", target)?,
            reference: inputs::image("reference", reference)?,
            target_depth: inputs::depth("targetDepth", &get(inputs, "targetDepth"), target_size)?,
            reference_depth: inputs::depth("referenceDepth", &get(inputs, "referenceDepth"), reference_size)?,
        })
    }

    pub fn target(&self) -> View<'_> {
        View { image: self.target.view(), depth: self.target_depth.as_ref() }
    }

    pub fn reference(&self) -> View<'_> {
        View { image: self.reference.view(), depth: self.reference_depth.as_ref() }
    }
}

/// A photo that a stage takes alone, its colours extended into its masked pixels.
pub(super) fn single_photo(name: &'static str, image: &JsValue, max_bytes: u64) -> Result<Image> {
    let size = size_from_js(name, image)?;
    check_inputs([size, size], max_bytes)?;
    let image = inputs::image(name, image)?;
    let extended = Extended::of(View { image: image.view(), depth: None }, name)?;
    Ok(extended.map_or(image, Extended::into_image))
}

//! The tasks of many photos as calls, which another worker performs.

use js_sys::{Array, Object, Uint32Array};
use wasm_bindgen::prelude::*;

use super::convert::{get, image_to_js, invalid, put};
use super::signatures::{OnProgress, PartialOptions};
use super::stages::observed;
use super::workers::SharedTask;
use super::{inputs, matches, options, results};
use crate::depth::Refined;
use crate::features::{Pair, matches_of};
use crate::geometry::{ModelKind, PairLink};
use crate::pipeline::many::{MatchPhotos, MatchStereo, MatchedPhotos, PhotoPair};
use crate::workers::Task;
use crate::{Image, InverseDepth, Result, Stage, View};

/// The features of two photos, matched. `photos` are both, `strongest_first` whether the strongest features will do if enough agree.
#[wasm_bindgen(js_name = matchPhotos)]
pub fn match_photos(
    photos: &Array,
    strongest_first: bool,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<Object, JsValue> {
    observed(Stage::Match, on_progress, &mut |observer| {
        let options = &options::from_js(options)?;
        let features = [0, 1].map(|i| matches::features("features", &photos.get(i)));
        let [first, second] = features;
        let features = [&first?, &second?];
        let task = MatchPhotos { photos: [0, 1], features, strongest_first, options };
        let MatchedPhotos { pair, link, outliers } = task.perform(observer)?;
        let result = results::numbers(&[("matches", pair.matches as f64), ("inliers", pair.inliers as f64)]);
        if let Some(link) = link {
            let pairs = link.features.as_flattened();
            put(&result, "pairs", Uint32Array::from(pairs).into());
            put(&result, "outliers", Uint32Array::from(outliers.as_flattened()).into());
            put(&result, "model", results::model(&link.model));
            put(&result, "parallax", (link.kind == ModelKind::TwoView).into());
        }
        Ok(result.unchecked_into())
    })
}

impl SharedTask for MatchPhotos<'_> {
    const NAME: &'static str = "matchPhotos";
    const STAGE: Stage = Stage::Match;

    fn arguments(&self) -> Array {
        let photos: Array = self.features.iter().map(|features| results::features(features)).collect();
        Array::of2(&photos, &self.strongest_first.into())
    }

    fn output(&self, result: &JsValue) -> Result<MatchedPhotos> {
        let Self { photos, features: [a, b], .. } = *self;
        let count = |name: &str| get(result, name).as_f64().unwrap_or(0.0) as usize;
        let features = |name: &str| {
            let pairs = get(result, name).dyn_into::<Uint32Array>().ok()?;
            Some(pairs.to_vec().as_chunks().0.to_vec())
        };
        let (pairs, outliers) = (features("pairs"), features("outliers").unwrap_or_default());
        let linked = pairs.is_some();
        let pair = PhotoPair { photos, matches: count("matches"), inliers: count("inliers"), linked };
        let Some(features) = pairs else { return Ok(MatchedPhotos { pair, link: None, outliers }) };
        let pairs: Vec<Pair> = features.iter().map(|&[target, reference]| Pair { target, reference }).collect();
        let model = inputs::model("model", &get(result, "model"))?;
        let kind = if get(result, "parallax").is_truthy() { ModelKind::TwoView } else { ModelKind::Homography };
        let link = PairLink { photos, matches: matches_of(a, b, &pairs), features, model, kind };
        Ok(MatchedPhotos { pair, link: Some(link), outliers })
    }
}

/// Stereo of two photos. `photos` are both with `depth` to start from, `models` lead from the first to the second and back, `error` is how far
/// they miss matches.
#[wasm_bindgen(js_name = matchStereo)]
pub fn match_stereo(
    photos: &Array,
    models: &Array,
    error: &Array,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<Object, JsValue> {
    observed(Stage::Depth, on_progress, &mut |observer| {
        let options = options::from_js(options)?.refine.unwrap_or_default();
        let [first, second] = [0, 1].map(|i| photo(&photos.get(i)));
        let (first, second) = (first?, second?);
        let [forward, reverse] = [0, 1].map(|i| inputs::model("model", &models.get(i)));
        let task = MatchStereo {
            photos: [0, 1],
            views: [view(&first), view(&second)],
            models: [forward?, reverse?],
            error: [0, 1].map(|i| error.get(i).as_f64().unwrap_or_default()),
            options,
        };
        let found = task.perform(observer)?;
        let result = results::numbers(&[("range", found.range)]);
        put(&result, "depth", [&found.target, &found.reference].map(results::depth).iter().collect::<Array>().into());
        put(&result, "reliable", found.reliable.each_ref().map(results::mask).iter().collect::<Array>().into());
        Ok(result.unchecked_into())
    })
}

/// A photo with its depth.
fn photo(value: &JsValue) -> Result<(Image, InverseDepth)> {
    let image = inputs::image("photo", value)?;
    let depth = depth(&get(value, "depth"), image.view().size())?;
    Ok((image, depth))
}

fn depth(value: &JsValue, size: (usize, usize)) -> Result<InverseDepth> {
    inputs::depth("depth", value, size)?.ok_or_else(|| invalid("depth", "an object", value))
}

fn view((image, depth): &(Image, InverseDepth)) -> View<'_> {
    View { image: image.view(), depth: Some(depth) }
}

impl SharedTask for MatchStereo<'_> {
    const NAME: &'static str = "matchStereo";
    const STAGE: Stage = Stage::Depth;

    fn arguments(&self) -> Array {
        let photo = |view: &View<'_>| {
            let image = view.image;
            let photo = image_to_js(image.data(), image.width(), image.height());
            view.depth.into_iter().for_each(|depth| put(&photo, "depth", results::depth(depth)));
            photo
        };
        let photos: Array = self.views.iter().map(photo).collect();
        let models: Array = self.models.iter().map(results::model).collect();
        Array::of3(&photos, &models, &results::list(&self.error))
    }

    fn output(&self, result: &JsValue) -> Result<Refined> {
        let (maps, reliable) = (Array::from(&get(result, "depth")), Array::from(&get(result, "reliable")));
        let [target, reference] = self.views.map(|view| view.image.size());
        let [first, second] = [0, 1].map(|i| inputs::mask("reliable", &reliable.get(i)));
        Ok(Refined {
            target: depth(&maps.get(0), target)?,
            reference: depth(&maps.get(1), reference)?,
            reliable: [first?, second?],
            range: get(result, "range").as_f64().unwrap_or_default(),
        })
    }
}

//! SIFT detection: from a photo to its features.

use super::approximation::TURN;
use super::descriptor::{SUPPORT, describe};
use super::extrema::{Extremum, Limits, SCALES};
use super::luma::luma;
use super::orientation::orientations;
use super::scale_space::{Builder, LEAST_SIDE, Levels, SIGMA};
use super::selection::select;
use super::{DetectOptions, Features, Keypoint};
use crate::distance::STRAIGHT;
use crate::image::indices;
use crate::observer::{Observer, report};
use crate::sort::sort_indices;
use crate::transparency::distance_to_missing;
use crate::{Error, ImageView, Result, Stage};

/// By which factor the contrast threshold may be lowered when there are too few keypoints.
const ADAPTATION: f64 = 8.0;
/// With this many keypoints the threshold is not lowered any further.
const ENOUGH: usize = 4000;
/// Keypoints described between two reports.
const BATCH: usize = 2048;

/// Finds keypoints and describes them. Photos smaller than 16 pixels have none. What is described touches no pixel that is not
/// there.
///
/// # Errors
/// `invalid-argument` for options out of range, `too-large` when more than `max_bytes` would be needed, `out-of-memory`,
/// `aborted`.
pub fn detect(image: ImageView<'_>, options: &DetectOptions, observer: &mut dyn Observer) -> Result<Features> {
    check(options)?;
    report(observer, Stage::Detect, 0.0)?;
    let full = image.size();
    let mut features = Features { keypoints: Vec::new(), descriptors: Vec::new(), size: full };
    let size = reduced(full, options.max_size);
    if size.0.min(size.1) < LEAST_SIDE {
        return Ok(features);
    }
    check_budget(size, options)?;

    // Extrema of the difference of Gaussians, octave by octave; the octaves' levels are kept for the descriptors.
    let strong = (255.0 * options.contrast_threshold / SCALES as f64) as f32;
    let edge = options.edge_threshold;
    let limits = Limits {
        contrast: if options.adaptive { strong / ADAPTATION as f32 } else { strong },
        edge: ((edge + 1.0) * (edge + 1.0) / edge) as f32,
    };
    let mut builder = Builder::new(luma(image, size)?, options.upsample);
    let mut octaves: Vec<Levels> = Vec::new();
    let mut found = Vec::new();
    while let Some(levels) = builder.octave(octaves.len() as u8, &limits, &mut found, observer)? {
        octaves.push(levels);
    }
    drop(builder);
    report(observer, Stage::Detect, 0.5)?;

    // The strongest, evenly distributed.
    let grow = if options.upsample { 2 } else { 1 };
    drop_touching(&mut found, image, full.0 as f32 / (grow * size.0) as f32)?;
    let enough = if options.adaptive { ENOUGH } else { 0 };
    let chosen = select(&found, strong, enough, options.max_keypoints, (grow * size.0, grow * size.1))?;
    drop(found);

    // Orientations and descriptors.
    describe_all(&octaves, &chosen, options, &mut features, observer)?;

    // From pixels of the first octave to pixels of the photo.
    let scale = [(full.0, size.0), (full.1, size.1)].map(|(full, size)| full as f32 / (grow * size) as f32);
    for keypoint in &mut features.keypoints {
        keypoint.x = (keypoint.x + 0.5) * scale[0] - 0.5;
        keypoint.y = (keypoint.y + 0.5) * scale[1] - 0.5;
        keypoint.scale *= (scale[0] * scale[1]).sqrt();
    }
    arrange(&mut features)?;
    report(observer, Stage::Detect, 1.0)?;
    Ok(features)
}

fn check(options: &DetectOptions) -> Result<()> {
    let (contrast, edge) = (options.contrast_threshold, options.edge_threshold);
    if !(0.0..=1.0).contains(&contrast) {
        let expected = "from 0 to 1";
        return Err(Error::InvalidArgument { name: "contrastThreshold", expected, value: contrast }.into());
    }
    if !(1.0..=f64::MAX).contains(&edge) {
        return Err(
            Error::InvalidArgument { name: "edgeThreshold", expected: "a number of at least 1", value: edge }.into()
        );
    }
    Ok(())
}

/// Refuses photos that would take more memory than allowed.
fn check_budget(size: (usize, usize), options: &DetectOptions) -> Result<()> {
    let (w, h) = (size.0 as u64, size.1 as u64);
    let (width, height) = if options.upsample { (2 * w, 2 * h) } else { (w, h) };
    // The gray picture; the levels of all octaves with what the next one starts from; the rows in the pipeline.
    let pixels = width.saturating_mul(height);
    let bytes = (4 * w).saturating_mul(h).saturating_add(pixels.saturating_mul(13)).saturating_add(width * 1600);
    if bytes > options.max_bytes {
        return Err(Error::TooLarge { width, height, bytes, limit: options.max_bytes }.into());
    }
    Ok(())
}

/// Standard deviation of a level, in pixels of its octave.
fn deviation(level: f64) -> f32 {
    (SIGMA * libm::exp(level * (std::f64::consts::LN_2 / SCALES as f64))) as f32
}

/// Drops the extrema of which a descriptor would touch a masked pixel; `scale` is pixels of the photo per pixel of the
/// first octave.
fn drop_touching(found: &mut Vec<Extremum>, image: ImageView<'_>, scale: f32) -> Result<()> {
    let Some(distances) = distance_to_missing(image)? else { return Ok(()) };
    found.retain(|extremum| {
        let grow = (1u32 << extremum.octave) as f32 * scale;
        let at = |k: usize, side: usize| (extremum.pixel[k] as f32 * grow).min((side - 1) as f32) as usize;
        let index = at(1, image.height()) * image.width() + at(0, image.width());
        let level = f64::from(extremum.level) + f64::from(extremum.offset[2]);
        let reach = (SUPPORT * deviation(level) + 1.0) * grow;
        distances.get(index).is_some_and(|&distance| f32::from(distance) > CHAMFER * reach * STRAIGHT as f32)
    });
    Ok(())
}

/// By how much more than the true one the chamfer distance may be.
const CHAMFER: f32 = 1.08;

/// The size at which features are looked for.
pub(crate) fn reduced((width, height): (usize, usize), limit: usize) -> (usize, usize) {
    let longer = width.max(height);
    if limit == 0 || longer <= limit {
        return (width, height);
    }
    let shrink = |side: usize| ((side as u64 * limit as u64 + longer as u64 / 2) / longer as u64).max(1) as usize;
    (shrink(width), shrink(height))
}

/// Keypoints and descriptors, in pixels of the first octave.
fn describe_all(
    octaves: &[Levels],
    chosen: &[Extremum],
    options: &DetectOptions,
    features: &mut Features,
    observer: &mut dyn Observer,
) -> Result<()> {
    for (i, batch) in chosen.chunks(BATCH).enumerate() {
        report(observer, Stage::Detect, 0.5 + 0.5 * (i * BATCH) as f32 / chosen.len() as f32)?;
        for extremum in batch {
            let Some(plane) = octaves.get(extremum.octave as usize).and_then(|o| o.get(extremum.level as usize - 1))
            else {
                continue;
            };
            let [x, y] = [0, 1].map(|i| extremum.pixel[i] as f32 + extremum.offset[i]);
            let level = f64::from(extremum.level) + f64::from(extremum.offset[2]);
            let sigma = deviation(level);
            let grow = (1u32 << extremum.octave) as f32;
            let shrink = 1.0 / plane.step as f32;
            let (place, deviation) = ([x * shrink, y * shrink], sigma * shrink);
            orientations(plane, place, deviation, &mut |direction| {
                features.keypoints.push(Keypoint {
                    x: x * grow,
                    y: y * grow,
                    scale: sigma * grow,
                    angle: direction * (2.0 * std::f32::consts::PI / TURN),
                    response: extremum.response,
                });
                features.descriptors.push(describe(plane, place, deviation, direction, options.root));
            });
        }
    }
    Ok(())
}

/// Sorts the features, the strongest first, and drops repeated ones.
fn arrange(features: &mut Features) -> Result<()> {
    let at = |i: u32| &features.keypoints[i as usize];
    let mut order = indices(features.keypoints.len())?;
    sort_indices(&mut order, &|a, b| at(a).by_place(at(b)).then(a.cmp(&b)));
    order.dedup_by(|a, b| at(*a).by_place(at(*b)).is_eq());
    sort_indices(&mut order, &|a, b| at(b).response.total_cmp(&at(a).response).then_with(|| at(a).by_place(at(b))));
    *features = features.permuted(&order)?;
    Ok(())
}

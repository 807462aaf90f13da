//! The inverse depth of each photo, 1/z in the unit of the cameras: from stereo with its best neighbours, where the landmarks
//! say what to expect; a smooth surface goes through what was found, and on beyond it.

use super::ManyWorkers;
use super::carried::carried;
use super::given::given_depth;
use super::planes::plane_depth_of;
use super::surface::surface;
use super::views::Views;
use crate::depth::{KnownDepth, OtherView, PhotoLines, Prior, RefineOptions, Refined, dense, refine_prior};
use crate::geometry::{DepthSample, Model, MultiView, MultiViewKind, PairLink, dominant_plane, plane_depth};
use crate::image::{filled, reserve};
use crate::observer::{Observer, Portion, Subject};
use crate::rect::diagonal;
use crate::statistics::median;
use crate::workers::Task;
use crate::{ImageView, InverseDepth, Mask, Result, View};

/// How many neighbours a photo is compared with.
const NEIGHBOURS: usize = 2;
/// Stereo starts from a map through the landmarks, which is far off where there are few, and then once more from the surface through
/// what it found: but not where more than this is known already.
const ROUNDS: usize = 2;
const ENOUGH_KNOWN: f64 = 0.5;
/// How much of the work the maps through the landmarks are, about.
const PRIORS: f32 = 0.1;
/// A neighbour that sees things shifted by less than this is no help, and beyond that a farther one is no better: shares of
/// the diagonal.
const LEAST_SHIFT: f64 = 0.001;
const MOST_SHIFT: f64 = 0.03;
/// More matches than this do not make a neighbour better.
const MOST_MATCHES: usize = 500;
/// Most landmarks of a photo that take part: more make the map no better, but slower.
const SAMPLES: usize = 1500;
/// Fewer landmarks are no surface.
const FEWEST: usize = 20;

/// Points of a photo and inverse depth there.
type Places = Vec<([f64; 2], f64)>;

/// The depth of one photo.
#[derive(Debug, Clone)]
pub(super) struct PhotoDepth {
    pub map: InverseDepth,
    /// How far the landmarks' map misses those left out of it, in pixels.
    pub prediction_error: f64,
    /// Whether it was given, and stays as it is.
    pub given: bool,
}

/// What was found of a photo.
struct Found<'a> {
    /// Inverse depth, NaN where it is not known.
    map: Option<&'a InverseDepth>,
    /// Carried over from other photos.
    carried: Places,
    lines: &'a PhotoLines,
}

/// A neighbour that is worth a comparison.
struct Neighbour {
    photos: [usize; 2],
    value: f64,
}

/// The depth of every photo of `used`, of which the first one is the reference, in whose view all are shown; `None` where landmarks are
/// too few, and everywhere without parallax.
pub(super) async fn depths(
    views: &[View<'_>],
    used: &[usize],
    geometry: &MultiView,
    links: &[PairLink],
    refine: Option<&RefineOptions>,
    workers: &dyn ManyWorkers,
    observer: &mut dyn Observer,
) -> Result<Vec<Option<PhotoDepth>>> {
    let photos: &[ImageView<'_>] = &views.iter().map(|view| view.image).collect::<Vec<_>>();
    let neighbours = neighbours(photos, used, geometry, links);
    let best = |photo: usize| {
        let found = neighbours.iter().find(|n| n.photos.contains(&photo))?;
        Some(found.photos[usize::from(found.photos[0] == photo)])
    };
    let mut depths: Vec<Option<PhotoDepth>> = vec![None; photos.len()];
    let Some(&reference) = used.first() else { return Ok(depths) };
    let mut known: Vec<Option<InverseDepth>> = vec![None; photos.len()];
    let mut lines_of: Vec<Option<PhotoLines>> = photos.iter().map(|_| None).collect();
    let share = PRIORS / used.len() as f32;
    for (i, &photo) in used.iter().enumerate() {
        observer.subject(Subject::Photo(photo));
        let mut portion = Portion::new(observer, share * i as f32, share * (i + 1) as f32);
        let other = best(photo).or_else(|| used.iter().copied().find(|other| *other != photo));
        if let (Some(own), Some(other)) = (views[photo].depth, other)
            && let Some(map) = given_depth(own, [photo, other], photos, geometry, &mut portion)?
        {
            known[photo] = Some(map.map.map_indexed(|_, d| d)?);
            depths[photo] = Some(map);
        } else if let Some(other) = best(photo) {
            depths[photo] = prior(&geometry.samples(photo, other), photos[photo], &mut portion)?;
        }
    }
    let observer = &mut Portion::new(observer, PRIORS, 1.0);
    for round in 0..ROUNDS {
        // What is known well already needs no better start.
        let poor = |photo: &usize| {
            let given = depths[*photo].as_ref().is_some_and(|depth| depth.given);
            !given && (round == 0 || known[*photo].as_ref().is_some_and(|map| coverage(map) < ENOUGH_KNOWN))
        };
        let poor: Vec<usize> = used.iter().copied().filter(poor).collect();
        let wanted = |neighbour: &&Neighbour| neighbour.photos.iter().any(|photo| poor.contains(photo));
        let pairs: Vec<[usize; 2]> = neighbours.iter().filter(wanted).map(|neighbour| neighbour.photos).collect();
        let steps = (ROUNDS * (pairs.len() + poor.len())) as f32;
        let mut done = (round * (pairs.len() + poor.len())) as f32;
        let matching = &mut Portion::new(observer, done / steps, (done + pairs.len() as f32) / steps);
        if let Some(refine) = refine {
            let task = |pair: &[usize; 2]| MatchStereo::of(photos, *pair, geometry, &depths, refine);
            let tasks: Vec<MatchStereo<'_>> = pairs.iter().filter_map(task).collect();
            let mut take = |i: usize, found: Refined| tasks[i].add(&found, &mut known);
            workers.perform(&tasks, &mut take, matching).await?;
        }
        done += pairs.len() as f32;
        // Only what stereo found says where planes are.
        let compared = if round > 0 && !poor.is_empty() { Some(Views::of(photos, used)?) } else { None };
        for &photo in &poor {
            observer.subject(Subject::Photo(photo));
            let mut portion = Portion::new(observer, done / steps, (done + 1.0) / steps);
            if let (Some(own), Some(other)) = (&mut depths[photo], best(photo)) {
                let others = [other, reference];
                // Where a photo knows most itself, the rest is what it sees past an edge: a surface would bend there.
                let found = match &compared {
                    Some(views) => beyond(photo, other, photos, views, &known, geometry)?,
                    None => (None, Vec::new()),
                };
                let (map, carried) = (found.0.as_ref().or(known[photo].as_ref()), found.1);
                let lines = match lines_of[photo].take() {
                    Some(lines) => lines,
                    None => PhotoLines::of(photos[photo])?,
                };
                let lines = lines_of[photo].insert(lines);
                complete(own, Found { map, carried, lines }, photo, others, photos, geometry, &mut portion)?;
            }
            done += 1.0;
        }
    }
    if geometry.kind == MultiViewKind::Cameras {
        for &photo in used {
            if depths[photo].is_none() {
                depths[photo] = Some(flat(photo, used, photos[photo].size(), geometry)?);
            }
        }
    }
    Ok(depths)
}

/// The depth of a photo that was taken where its neighbours were, so that nothing else is known of it: that of its landmarks, or infinity.
fn flat(photo: usize, used: &[usize], size: (usize, usize), geometry: &MultiView) -> Result<PhotoDepth> {
    let samples = used.iter().flat_map(|other| geometry.samples(photo, *other));
    let depth = median(samples.map(|sample| sample.depth).collect()).unwrap_or(0.0);
    Ok(PhotoDepth { map: InverseDepth::constant(depth as f32, size.0, size.1)?, prediction_error: 0.0, given: false })
}

/// What is known of a photo but for what is on planes, where nothing is textured; and what the planes and other photos say of the rest.
fn beyond(
    photo: usize,
    other: usize,
    photos: &[ImageView<'_>],
    views: &Views,
    known: &[Option<InverseDepth>],
    geometry: &MultiView,
) -> Result<(Option<InverseDepth>, Places)> {
    let mut samples = carried(photo, known, photos[photo].size(), geometry);
    let Some(planes) = plane_depth_of([photo, other], photos, views, known, geometry)? else {
        return Ok((None, samples));
    };
    samples.retain(|(point, _)| !planes.covers(*point));
    let own = known[photo].as_ref().map(|map| {
        let width = map.width();
        map.map_indexed(|i, d| if planes.covers([i % width, i / width].map(|v| v as f64)) { f32::NAN } else { d })
    });
    samples.extend(planes.samples);
    Ok((own.transpose()?, samples))
}

/// Replaces a photo's map by a surface through what was found, or through the map itself. `others` are its
/// best neighbour and the reference.
fn complete(
    own: &mut PhotoDepth,
    Found { map, carried, lines }: Found<'_>,
    photo: usize,
    others: [usize; 2],
    photos: &[ImageView<'_>],
    geometry: &MultiView,
    observer: &mut dyn Observer,
) -> Result<()> {
    let [Some(model), Some(view)] = others.map(|other| geometry.model([photo, other])) else { return Ok(()) };
    let [size, reference] = others.map(|photo| photos[photo].size());
    let map = map.unwrap_or(&own.map).map_indexed(|_, d| d)?;
    let carried = carried.into_iter().map(|(point, depth)| DepthSample::new(&model, point, depth)).collect();
    let image = photos[photo];
    let mut known =
        KnownDepth::and_samples(map, carried, (image, &lines.parts), OtherView::new(&model, size), observer)?;
    if let Some(surface) = surface(&mut known, &lines.joined, &view, reference)? {
        own.map = surface;
    }
    Ok(())
}

/// The share of a map's pixels that are known.
fn coverage(map: &InverseDepth) -> f64 {
    map.data().iter().filter(|d| !d.is_nan()).count() as f64 / map.data().len() as f64
}

/// The pairs to compare, the best first: of each photo's best ones.
fn neighbours(photos: &[ImageView<'_>], used: &[usize], geometry: &MultiView, links: &[PairLink]) -> Vec<Neighbour> {
    let mut found: Vec<Neighbour> = Vec::new();
    for link in links.iter().filter(|link| link.photos.iter().all(|photo| used.contains(photo))) {
        let [a, b] = link.photos;
        let shifts = geometry.samples(a, b).iter().map(|s| (s.depth * s.parallax).abs()).collect();
        let Some(shift) = median(shifts) else { continue };
        let shift = shift / diagonal(photos[b].size());
        if shift < LEAST_SHIFT {
            continue;
        }
        let value = link.matches.len().min(MOST_MATCHES) as f64 * shift.min(MOST_SHIFT);
        let at = found.iter().position(|other| other.value < value).unwrap_or(found.len());
        found.insert(at, Neighbour { photos: link.photos, value });
    }
    let mut counts = vec![0; photos.len()];
    found.retain(|neighbour| {
        let wanted = neighbour.photos.iter().any(|&photo| counts[photo] < NEIGHBOURS);
        if wanted {
            neighbour.photos.iter().for_each(|&photo| counts[photo] += 1);
        }
        wanted
    });
    found
}

/// A map through the landmarks; `None` of too few.
pub(super) fn prior(
    samples: &[DepthSample],
    photo: ImageView<'_>,
    observer: &mut dyn Observer,
) -> Result<Option<PhotoDepth>> {
    let step = samples.len().div_ceil(SAMPLES).max(1);
    let mut samples: Vec<DepthSample> = samples.iter().step_by(step).copied().collect();
    if samples.len() < FEWEST {
        return Ok(None);
    }
    let Some(plane) = dominant_plane(&samples, 1.0) else { return Ok(None) };
    samples.iter_mut().for_each(|s| s.depth -= plane_depth(plane, s.point));
    let square = samples.iter().map(|s| s.depth * s.depth).sum::<f64>() / samples.len() as f64;
    let size = if square.sqrt().is_normal() { square.sqrt() } else { 1.0 };
    samples.iter_mut().for_each(|s| (s.depth, s.parallax) = (s.depth / size, s.parallax * size));
    let (map, prediction_error) = dense(&samples, photo, observer)?;
    let width = photo.width();
    let map = map.map_indexed(|i, v| {
        (f64::from(v) * size + plane_depth(plane, [(i % width) as f64, (i / width) as f64])) as f32
    })?;
    Ok(Some(PhotoDepth { map, prediction_error, given: false }))
}

/// The task to match two photos pixel by pixel.
pub(crate) struct MatchStereo<'a> {
    /// Indices of both.
    pub photos: [usize; 2],
    /// Both, with the maps to start from.
    pub views: [View<'a>; 2],
    /// From the first one to the second, and back.
    pub models: [Model; 2],
    /// With which the maps predict inliers: see [`Prior`].
    pub error: [f64; 2],
    pub options: RefineOptions,
}

impl<'a> MatchStereo<'a> {
    /// `None` where the photos have no depth to start from.
    fn of(
        photos: &[ImageView<'a>],
        pair: [usize; 2],
        geometry: &MultiView,
        depths: &'a [Option<PhotoDepth>],
        options: &RefineOptions,
    ) -> Option<Self> {
        let [a, b] = pair;
        let view = |photo: usize, depth: &'a PhotoDepth| View { image: photos[photo], depth: Some(&depth.map) };
        let (first, second) = (depths[a].as_ref()?, depths[b].as_ref()?);
        Some(Self {
            photos: pair,
            views: [view(a, first), view(b, second)],
            models: [geometry.model([a, b])?, geometry.model([b, a])?],
            error: [first.prediction_error, second.prediction_error],
            options: *options,
        })
    }

    /// Adds what was found reliable to what is `known` of either photo, which stays.
    fn add(&self, found: &Refined, known: &mut [Option<InverseDepth>]) -> Result<()> {
        let [a, b] = self.photos;
        let [of_first, of_second] = &found.reliable;
        let [forward, reverse] = &self.models;
        let [first, second] = self.views.map(|view| view.image.size());
        add(&mut known[a], &found.target, of_first, &OtherView::new(forward, second))?;
        add(&mut known[b], &found.reference, of_second, &OtherView::new(reverse, first))
    }
}

impl Task for MatchStereo<'_> {
    type Output = Refined;

    fn subject(&self) -> Subject {
        Subject::Pair(self.photos)
    }

    fn perform(&self, observer: &mut dyn Observer) -> Result<Refined> {
        let [first, second] = self.views;
        let [forward, reverse] = &self.models;
        let prior = Prior { error: self.error, weak: true, reliable_only: true };
        refine_prior(first, second, forward, reverse, prior, &self.options, observer)
    }
}

/// Adds what is reliable, and does not land next to the border of the other photo, where nothing is known yet.
fn add(known: &mut Option<InverseDepth>, depth: &InverseDepth, reliable: &Mask, other: &OtherView<'_>) -> Result<()> {
    let (width, height) = depth.size();
    let before = match known.take() {
        Some(before) => before.into_values(),
        None => filled(width * height, f32::NAN)?,
    };
    let mut values = Vec::new();
    reserve(&mut values, width * height)?;
    let all = before.into_iter().zip(depth.data()).zip(reliable.data());
    values.extend(all.enumerate().map(|(i, ((before, &d), &mark))| {
        if !before.is_nan() || mark == 0 {
            return before;
        }
        let point = [i % width, i / width].map(|p| p as f64);
        if other.contains(point, f64::from(d)) { d } else { f32::NAN }
    }));
    *known = Some(InverseDepth::from_values(values, width, height));
    Ok(())
}

//! Every stage on the synthetic gallery and on the real pair where there is one, per pixel of the target: `cargo bench -p benches`.
//! `npm run bench` times the wasm.
//!
//! The real pair is read from `DEPTHSTITCH_DATA`.
#![allow(clippy::expect_used)]

use std::hint::black_box;

use criterion::{BatchSize, BenchmarkGroup, Criterion, Throughput, measurement::WallTime};
use depthstitch::View;
use depthstitch::features::{self, DetectOptions, detect, match_features};
use depthstitch::geometry::{Frame, Match, estimate};
use depthstitch::metrics::quality;
use depthstitch::mosaic::{BlendOptions, FillGuide, SeamGuide, blend, fill};
use depthstitch::pipeline::{Options, stitch};
use depthstitch::warp::{WarpMode, WarpOptions, warp};
use scene::{MatchOptions, Photos};

/// The size of the paper's photos.
const SIZE: (usize, usize) = (1000, 662);

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    all(&mut criterion);
    criterion.final_summary();
}

fn all(criterion: &mut Criterion) {
    let gallery = scene::gallery();
    let pair = gallery.render(SIZE.0, SIZE.1);
    let photos = Photos::of(&pair, &MatchOptions { count: 1000, sigma: 0.3, outliers: 0.1, seed: 1 });
    stages(&mut criterion.benchmark_group("gallery"), &photos.matches, photos.target(), photos.reference());

    let Some(folder) = cases::real_case("nis-PTS_17") else { return };
    let case = cases::load(&folder).photos;
    stages(&mut criterion.benchmark_group("nis-PTS_17"), &case.matches, case.target(), case.reference());
}

fn stages(group: &mut BenchmarkGroup<'_, WallTime>, matches: &[Match], target: View<'_>, reference: View<'_>) {
    let options = Options::default();
    let frame = |view: &View<'_>| view.image.size();
    let [from, to] = [target, reference].map(|view| Frame { size: frame(&view), depth: view.depth });
    let pixels = from.size.0 * from.size.1;
    group.sample_size(20).throughput(Throughput::Elements(pixels as u64));

    let how = DetectOptions::default();
    let [a, b] = [target, reference].map(|view| detect(view.image, &how, &mut ()).expect("it fits"));
    group.bench_function("detect", |b| {
        b.iter(|| detect(black_box(target.image), &how, &mut ()).expect("it fits"));
    });
    let how = features::MatchOptions::default();
    group.bench_function("match", |bench| {
        bench.iter(|| match_features(black_box(&a), &b, &how, &mut ()).expect("they fit"));
    });

    let geometry = estimate(matches, from, to, &options.estimate, &mut ()).expect("the pair has a geometry");
    group.bench_function("estimate", |b| {
        b.iter(|| estimate(black_box(matches), from, to, &options.estimate, &mut ()).expect("as before"));
    });

    let (forward, reverse) = (&geometry.forward, &geometry.reverse);
    for (name, mode) in [
        ("forward", WarpMode::Forward),
        ("backward", WarpMode::Backward),
        ("backward+void", WarpMode::BackwardVoid),
        ("optimal", WarpMode::Optimal),
    ] {
        let options = WarpOptions { mode, ..options.warp.clone() };
        group.bench_function(format!("warp {name}"), |b| {
            b.iter(|| warp(black_box(target), reference, forward, reverse, &options, &mut ()).expect("it overlaps"));
        });
    }

    let mut warped = warp(target, reference, forward, reverse, &options.warp, &mut ()).expect("it overlaps");
    group.bench_function("measure", |b| {
        b.iter(|| quality(black_box(&warped), reference.image, [1.0; 3]).expect("it overlaps"))
    });
    for (name, how) in [("average", BlendOptions::paper()), ("blend", BlendOptions::default())] {
        group.bench_function(name, |b| {
            b.iter(|| {
                blend(black_box(&warped), reference.image, &SeamGuide::default(), &how, &mut ()).expect("it fits")
            });
        });
    }

    let mosaic =
        blend(&warped, reference.image, &SeamGuide::default(), &BlendOptions::paper(), &mut ()).expect("it fits");
    let how = options.fill.clone().unwrap_or_default();
    let guide = FillGuide::new(&mut warped, &mosaic.seam, forward, reference).expect("it fits");
    group.bench_function("fill", |b| {
        b.iter_batched_ref(
            || mosaic.image.clone(),
            |image| fill(image, &mosaic.voids, guide.as_ref(), &how, &mut ()).expect("it fits"),
            BatchSize::LargeInput,
        );
    });

    group.bench_function("stitch", |b| {
        b.iter(|| stitch(black_box(Some(matches)), target, reference, &options, &mut ()).expect("it overlaps"));
    });
}

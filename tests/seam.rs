//! Which of two pictures made by formula shows where.
#![allow(clippy::unwrap_used)]

mod pictures;

use depthstitch::Mask;
use depthstitch::geometry::Match;
use depthstitch::mosaic::{BlendOptions, Composition, Exposure, Layer, Seam, SeamGuide, blend};
use depthstitch::warp::Warped;
use pictures::mask;
use pictures::overlap::{CANVAS, LEFT, compose, reference, stage, texture};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Whether the seam passes between two pixels of the region.
fn passes(seam: &Mask, inside: impl Fn(usize, usize) -> bool) -> bool {
    let differ = |a: usize, b: usize| seam.data()[a] ^ seam.data()[b] == 3;
    (0..seam.data().len()).any(|i| {
        let (x, y) = (i % seam.width(), i / seam.width());
        inside(x, y)
            && (x + 1 < seam.width() && inside(x + 1, y) && differ(i, i + 1)
                || y + 1 < seam.height() && inside(x, y + 1) && differ(i, i + seam.width()))
    })
}

#[test]
fn the_seam_avoids_what_moved_and_what_is_unreliable() {
    let options = BlendOptions { exposure: Exposure::Off, ..BlendOptions::default() };
    // A bar across most of the overlap, so that the shortest way would lead through it.
    for bar in [10..80, 25..100, 0..70] {
        let moved = |x: usize, y: usize| (66..112).contains(&x) && bar.contains(&y);
        let bright = |x: usize, y: usize| if moved(x, y) && (x + y) % 7 < 4 { [250, 250, 20] } else { texture(x, y) };
        let mosaic = compose(&stage(|x, _| x < 120, bright), &reference(texture), &options).unwrap();
        assert!(!passes(&mosaic.seam, moved), "the seam crosses what moved in {bar:?}");

        let reliable = mask(100, 100, |x, y| !moved(x + LEFT, y));
        let (warped, other) = (stage(|x, _| x < 120, texture), reference(texture));
        let mosaic =
            blend(&warped, other.view(), &SeamGuide { reliable: Some(&reliable), matches: &[] }, &options, &mut ())
                .unwrap();
        assert!(!passes(&mosaic.seam, moved), "the seam crosses what is unreliable in {bar:?}");
    }
}

#[test]
fn the_seam_rather_goes_a_long_way_round_an_object_than_a_short_one_through_it() {
    // Two bars in the target, the upper one open on the left and the lower one on the right, and a little noise elsewhere.
    let upper = |x: usize, y: usize| (30..34).contains(&y) && !(66..76).contains(&x);
    let lower = |x: usize, y: usize| (64..68).contains(&y) && !(104..114).contains(&x);
    let bar = move |x: usize, y: usize| upper(x, y) || lower(x, y);
    let target = |x: usize, y: usize| if bar(x, y) { [250; 3] } else { [140 + 8 * ((x + y) % 2) as u8; 3] };
    let warped = stage(|x, _| x < 120, target);
    let found =
        compose(&warped, &reference(|_, _| [132; 3]), &BlendOptions { exposure: Exposure::Off, ..Default::default() });
    // Bars reach the photos' borders, next to which there is nothing to decide.
    let inner = |x: usize| (64..116).contains(&x);
    assert!(!passes(&found.unwrap().seam, |x, y| bar(x, y) && inner(x)));
}

#[test]
fn the_seam_avoids_edges_even_where_the_photos_agree() {
    // An upright edge in the middle of the overlap, around which alone both are the same.
    let edge = |x: usize| if x < 90 { 100 } else { 160 };
    let target = |x: usize, _: usize| [if (86..94).contains(&x) { edge(x) } else { edge(x) + 4 }; 3];
    let warped = stage(|x, _| x < 120, target);
    let options = BlendOptions { exposure: Exposure::Off, ..Default::default() };
    let mosaic = compose(&warped, &reference(|x, _| [edge(x); 3]), &options).unwrap();
    assert!(!passes(&mosaic.seam, |x, _| (88..92).contains(&x)), "the seam runs along the edge");
}

/// The reference is not distorted: what looks different in the target is shown by the reference, although the target would agree a little
/// better with it on the other side.
#[test]
fn the_reference_shows_what_looks_different() {
    let target = |x: usize, _: usize| match x {
        ..84 => [134; 3],
        84..108 => [200; 3],
        _ => [132; 3],
    };
    let warped = stage(|x, _| x < 120, target);
    let options = BlendOptions { exposure: Exposure::Off, ..Default::default() };
    let mosaic = compose(&warped, &reference(|_, _| [132; 3]), &options).unwrap();
    assert!(!passes(&mosaic.seam, |x, _| x > 84), "the seam is behind what looks different");
}

/// A tower that leans in the target, which covers all of the reference and differs from it by a little everywhere: without any seam it
/// would be the target's.
#[test]
fn the_reference_shows_what_leans_though_the_target_covers_it() {
    let tower = |x: usize, y: usize| (100..112).contains(&x) && (24..76).contains(&y);
    let leaning = |x: usize, y: usize| if tower(x - y.saturating_sub(24) / 5, y) { [60; 3] } else { [203; 3] };
    let warped = stage(|_, _| true, |x, y| if x > 20 { leaning(x, y) } else { [203; 3] });
    let other = reference(|x, y| if tower(x, y) { [60; 3] } else { [200; 3] });
    let options = BlendOptions { exposure: Exposure::Off, ..Default::default() };
    let mosaic = compose(&warped, &other, &options).unwrap();
    // The same of a set of photos, whose labels are the target's and the reference's of two.
    let mut set = Composition::of(other.view(), None, 2).unwrap();
    set.add(&warped, [0, 0], Layer { label: 1, gains: None, matches: &[] }, &options, &mut ()).unwrap();
    for labels in [&mosaic.seam, &set.labels] {
        let shown = (0..CANVAS.0 * CANVAS.1).filter(|i| tower(i % CANVAS.0, i / CANVAS.0)).map(|i| labels.data()[i]);
        assert_eq!(shown.filter(|label| *label != 2).count(), 0, "the target shows of the tower");
    }
}

/// A sign that the photos show 30 pixels apart, with nothing between its two places that would keep the seam from passing there: it would be seen
/// twice, or not at all.
#[test]
fn what_the_photos_show_at_two_places_is_seen_once() {
    let options = BlendOptions { exposure: Exposure::Off, seam: Seam::Cut, ..Default::default() };
    for [own, other] in [[70, 100], [100, 70]] {
        let sign = |left: usize, x: usize, y: usize| (left..left + 10).contains(&x) && (30..70).contains(&y);
        let target = |x: usize, y: usize| match x {
            _ if sign(own, x, y) => [90, 30, 120],
            82..98 => [140; 3],
            _ => [146; 3],
        };
        let warped = stage(|x, _| x < 120, target);
        let reference = reference(|x, y| if sign(other, x, y) { [90, 30, 120] } else { [140; 3] });
        let place = |left: usize, y: f64| [left as f64 + 4.5, y];
        let match_at = |y: usize| Match { target: place(own, y as f64), reference: place(other, y as f64) };
        let matches: Vec<Match> = (30..70).step_by(3).map(match_at).collect();
        let seen = |labels: &Mask| {
            let shows = |left: usize, label: u8| {
                (0..CANVAS.0 * CANVAS.1)
                    .filter(|i| sign(left, i % CANVAS.0, i / CANVAS.0))
                    .all(|i| labels.data()[i] == label)
            };
            usize::from(shows(own, 1)) + usize::from(shows(other, 2))
        };
        let mosaic = |matches| {
            let guide = SeamGuide { reliable: None, matches };
            blend(&warped, reference.view(), &guide, &options, &mut ()).unwrap()
        };
        assert_ne!(seen(&mosaic(&[]).seam), 1, "the seam goes round by itself");
        assert_eq!(seen(&mosaic(&matches).seam), 1, "with {own} and {other}");

        // The same of a set of photos, where places are in pixels of the reference's view.
        let in_view = |[x, y]: [f64; 2]| [x - LEFT as f64, y];
        let labelled = |label: u8| -> Vec<(Match, u8)> {
            let place = |m: &Match| Match { target: in_view(m.target), reference: in_view(m.reference) };
            matches.iter().map(|m| (place(m), label)).collect()
        };
        let set = |matches: &[(Match, u8)]| {
            let mut set = Composition::of(reference.view(), None, 2).unwrap();
            set.add(&warped, [0, 0], Layer { label: 1, gains: None, matches }, &options, &mut ()).unwrap();
            set
        };
        assert_eq!(seen(&set(&labelled(2)).labels), 1, "of a set, with {own} and {other}");
        // Another photo's matches say nothing of what this one shows.
        assert_eq!(set(&labelled(3)).labels, set(&[]).labels);
    }
}

/// A confidence of 0 where `unreliable`.
fn unreliable_where(warped: Warped, unreliable: impl Fn(usize, usize) -> bool) -> Warped {
    Warped { confidence: Some(mask(CANVAS.0, CANVAS.1, |x, y| !unreliable(x, y))), ..warped }
}

/// The band along the reference's border that void recovery would take out: the seam passes behind it, and through it where the
/// photos look alike.
#[test]
fn an_unreliable_band_does_not_hold_the_seam_at_the_border() {
    let band = |x: usize, _: usize| (LEFT..LEFT + 12).contains(&x);
    let warped = unreliable_where(stage(|x, _| x < 120, texture), band);
    let mosaic = compose(&warped, &reference(texture), &BlendOptions::default()).unwrap();
    assert!(!passes(&mosaic.seam, |x, _| x < LEFT + 4), "the seam is at the border");
}

/// What is unreliable and looks unlike the reference is not shown where the reference reaches.
#[test]
fn the_reference_shows_where_the_target_is_unreliable() {
    let torn = |x: usize, y: usize| (70..110).contains(&x) && (30..70).contains(&y);
    let target = |x: usize, y: usize| if torn(x, y) { [250, 30, 20] } else { texture(x, y) };
    let warped = unreliable_where(stage(|x, _| x < 120, target), torn);
    let mosaic = compose(&warped, &reference(texture), &BlendOptions::default()).unwrap();
    let shown = (0..CANVAS.0 * CANVAS.1).filter(|i| torn(i % CANVAS.0, i / CANVAS.0) && mosaic.seam.data()[*i] == 1);
    assert!(shown.count() < 40, "the target shows where it is torn");
}

/// Patches in which the photos agree here and there make no islands.
#[test]
fn there_are_no_small_islands() {
    let differ = |x: usize, y: usize| (x / 5 + y / 5).is_multiple_of(2);
    let target = |x: usize, y: usize| texture(x, y).map(|v| if differ(x, y) { v + 60 } else { v });
    let mosaic = compose(&stage(|x, _| x < 120, target), &reference(texture), &BlendOptions::default()).unwrap();
    let seam = mosaic.seam.data();
    let mut seen = vec![false; seam.len()];
    let mut regions = 0;
    for first in 0..seam.len() {
        let mut open = vec![first];
        regions += usize::from(!seen[first]);
        while let Some(at) = open.pop() {
            if std::mem::replace(&mut seen[at], true) {
                continue;
            }
            let (x, y) = (at % CANVAS.0, at / CANVAS.0);
            let mut visit = |there: bool, other: usize| {
                if there && seam[other] == seam[at] && !seen[other] {
                    open.push(other);
                }
            };
            visit(x > 0, at.wrapping_sub(1));
            visit(x + 1 < CANVAS.0, at + 1);
            visit(y > 0, at.wrapping_sub(CANVAS.0));
            visit(y + 1 < CANVAS.1, at + CANVAS.0);
        }
    }
    assert_eq!(regions, 2);
}

#![cfg(not(target_arch = "wasm32"))]
use depthstitch::InverseDepth;
use depthstitch::geometry::*;
use depthstitch::image::DepthKind;
use std::path::PathBuf;

/// A truth-annotated pair.
struct Case {
    matches: Vec<Match>,
    depth: [InverseDepth; 2],
    sizes: [(usize, usize); 2],
    truth: Option<(Model, Model)>,
    truth_depth: [InverseDepth; 2],
}

fn data() -> PathBuf {
    std::env::var_os("DEPTHSTITCH_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from)
}

fn numbers(json: &str, key: &str) -> Option<Vec<f64>> {
    let at = json.find(&format!("\"{key}\":"))?;
    let rest = &json[at + key.len() + 3..];
    let rest = rest.trim_start();
    let mut depth = 0;
    let mut end = 0;
    for (i, c) in rest.char_indices() {
        match c {
            '[' => depth += 1,
            ']' => depth -= 1,
            _ => {}
        }
        if depth == 0 && (c == ']' || c == ',' || c == '}') {
            end = i;
            break;
        }
    }
    let v: Vec<f64> = rest[..end].split(['[', ']', ',']).filter_map(|t| t.trim().parse().ok()).collect();
    (!v.is_empty()).then_some(v)
}

fn load_depth(dir: &std::path::Path, json: &str) -> [InverseDepth; 2] {
    let kind = if json.contains("\"metric\"") { DepthKind::Metric } else { DepthKind::Inverse };
    let scale = numbers(json, "scale").unwrap()[0] as f32;
    let invalid = numbers(json, "invalid").map(|v| v[0] as f32 * scale);
    ["target_depth.png", "reference_depth.png"].map(|f| {
        let img = image::open(dir.join(f)).unwrap();
        let (w, h) = (img.width() as usize, img.height() as usize);
        let raw: Vec<f32> = match img {
            image::DynamicImage::ImageLuma8(i) => i.into_raw().into_iter().map(f32::from).collect(),
            i => i.into_luma16().into_raw().into_iter().map(f32::from).collect(),
        };
        let raw: Vec<f32> = raw.into_iter().map(|v| v * scale).collect();
        InverseDepth::new("depth", &raw, (w, h), kind, invalid, (w, h)).unwrap()
    })
}

fn load(name: &str) -> Case {
    let dir = data().join(name);
    let json = std::fs::read_to_string(dir.join("case.json")).unwrap();
    let depth = load_depth(&dir, &json);
    let sizes = [0, 1].map(|i| (depth[i].width(), depth[i].height()));
    let matches = std::fs::read_to_string(dir.join("matches.csv"))
        .unwrap()
        .lines()
        .skip(1)
        .map(|l| {
            let v: Vec<f64> = l.split(',').map(|t| t.trim().parse().unwrap()).collect();
            Match { target: [v[0], v[1]], reference: [v[2], v[3]] }
        })
        .collect();
    let m = |h: &str, e: &str| {
        Some(Model {
            h: nalgebra::Matrix3::from_row_slice(&numbers(&json, h)?),
            e: nalgebra::Vector3::from_row_slice(&numbers(&json, e)?),
        })
    };
    let truth = m("H_inf", "e_prime").zip(m("H_inf_reverse", "e_prime_reverse"));
    let truth_depth = match name.strip_prefix("mono-") {
        Some(t) => {
            let d = data().join(t);
            load_depth(&d, &std::fs::read_to_string(d.join("case.json")).unwrap())
        }
        None => depth.clone(),
    };
    Case { matches, depth, sizes, truth, truth_depth }
}

fn error(
    model: &Model,
    truth: &Model,
    d: &InverseDepth,
    td: &InverseDepth,
    size: (usize, usize),
) -> [Option<[f64; 2]>; 2] {
    let (mut a, mut b) = (vec![], vec![]);
    for y in (0..d.height()).step_by(4) {
        for x in (0..d.width()).step_by(4) {
            let (z, t) = (f64::from(d.data()[y * d.width() + x]), f64::from(td.data()[y * d.width() + x]));
            if !(t.is_finite() && t > 0.0 && z.is_finite()) {
                continue;
            }
            let [u, v, w] = truth.transform(x as f64, y as f64, t);
            let p = [u / w, v / w];
            let [mu, mv, mw] = model.transform(x as f64, y as f64, z);
            let e = ((mu / mw - p[0]).powi(2) + (mv / mw - p[1]).powi(2)).sqrt();
            if p[0] >= 0.0 && p[1] >= 0.0 && p[0] < size.0 as f64 && p[1] < size.1 as f64 && w > 0.0 {
                a.push(e)
            } else if p[0].abs() < 3000.0 && p[1].abs() < 3000.0 {
                b.push(e)
            }
        }
    }
    [a, b].map(|mut s| {
        s.sort_by(f64::total_cmp);
        (s.len() > 20).then(|| [s[s.len() / 2], s[s.len() * 9 / 10]])
    })
}

#[test]
fn probe() {
    for name in [
        "nis-PTS_17",
        "middlebury2005-Art",
        "middlebury2003-Cones",
        "icl-0025_0090",
        "icl-0160_0175",
        "icl-0000_0040",
        "tartanair-0050_0060",
        "tartanair-0180_0188",
        "icl-0002_0004",
        "kinect-0002_0003",
        "mono-icl-0025_0090",
        "mono-icl-0160_0175",
        "mono-middlebury2003-Cones",
        "mono-middlebury2005-Art",
        "mono-tartanair-0050_0060",
    ] {
        let c = load(name);
        for threshold in [Threshold::PAPER, Threshold::Pixels(3.0)] {
            println!("{name} {threshold:?}");
            for seed in 1..11 {
                let t = std::time::Instant::now();
                let r = estimate(
                    &c.matches,
                    Frame { size: c.sizes[0], depth: Some(&c.depth[0]) },
                    Frame { size: c.sizes[1], depth: Some(&c.depth[1]) },
                    &EstimateOptions { seed, threshold, ..Default::default() },
                    &mut (),
                );
                let ms = t.elapsed().as_secs_f64() * 1e3;
                let r = match r {
                    Ok(r) => r,
                    Err(e) => {
                        println!("  {e}");
                        continue;
                    }
                };
                print!(
                    "  {seed:2} {:?} {}/{} trials {} {:.1}ms res {:.2?} {:?}",
                    r.kind,
                    r.inliers.iter().filter(|f| **f).count(),
                    r.usable,
                    r.trials,
                    ms,
                    r.residual,
                    r.warnings
                );
                if let Some((f, rv)) = &c.truth {
                    let e = error(&r.forward, f, &c.depth[0], &c.truth_depth[0], c.sizes[1]);
                    let q = error(&r.reverse, rv, &c.depth[1], &c.truth_depth[1], c.sizes[0]);
                    print!(
                        " F {:.2?} {:.2?} R {:.2?} {:.2?}",
                        e[0].unwrap_or_default(),
                        e[1].unwrap_or_default(),
                        q[0].unwrap_or_default(),
                        q[1].unwrap_or_default()
                    );
                }
                println!();
            }
        }
    }
}

use super::points::*;
use super::clean::*;
use super::consensus::*;
use super::ransac::Search;
use super::sampler::Sampler;
use super::*;

pub fn probe(matches: &[Match], target: Frame<'_>, reference: Frame<'_>, seed: u32, mut eval: impl FnMut(&str, &Model)) {
    let usable = clean(matches, &target, &reference);
    let mut px = Points::default();
    let mut rv = Points::default();
    for m in usable.iter().filter(|m| m.has_depth()) { px.push(m.target, m.target_depth, m.reference); rv.push(m.reference, m.reference_depth, m.target); }
    let norm = Normalisation::of(&px);
    let pts = norm.apply(&px);
    let nr = Normalisation::of(&rv);
    let rpts = nr.apply(&rv);
    let s = norm.scale();
    let paper = 0.1;
    let t3 = 3.0 * s;
    println!("n {} wide px {:.1}", pts.len(), paper / s);
    let se = |t: f64, local| Search { threshold: t, confidence: 0.99, max_trials: 2000, local };
    let show = |name: &str, c: &Consensus| {
        let costs: Vec<f64> = [3.0, 5.0, 8.0, 15.0].iter().map(|&t| cost(&pts, c, t * s) / (t * s).powi(2)).collect();
        println!("  {name}: inl {} at {:.1}px trials {} msac/t² 3,5,8,15: {:.1?}", c.count(), c.threshold / s, c.trials, costs);
    };
    let mut sampler = Sampler::new(seed);
    let t0 = std::time::Instant::now();
    let w = search::<4>(&pts, &se(paper, false), &mut sampler).unwrap();
    let t1 = std::time::Instant::now();
    let p = refined(&pts, &w.inliers, None, 4).unwrap();
    let pr = refined(&rpts, &w.inliers, None, 4).unwrap();
    println!("  time ransac {:?} refine both {:?}", t1 - t0, t1.elapsed());
    show("paper", &Consensus { projection: p, ..w.clone() });
    eval("  paper", &norm.model(&p)); eval("R paper", &nr.model(&pr));
    let t1 = std::time::Instant::now();
    let w = search::<4>(&pts, &se(paper, true), &mut sampler).unwrap();
    println!("  time lo-ransac {:?}", t1.elapsed());
    for t in [8.0, 5.0, 3.0] {
        let t1 = std::time::Instant::now();
        let c = narrow(&pts, w.clone(), t * s, 4);
        println!("  time narrow {:?}", t1.elapsed());
        show(&format!("wide->{t}"), &c);
        eval(&format!("  wide->{t}"), &norm.model(&c.projection));
        let pr = refined(&rpts, &c.inliers, None, 4).unwrap();
        eval(&format!("R wide->{t}"), &nr.model(&pr));
    }
    let t1 = std::time::Instant::now();
    let d = search::<4>(&pts, &se(t3, true), &mut sampler).unwrap();
    println!("  time lo-ransac 3 {:?}", t1.elapsed());
    let c = narrow(&pts, d, t3, 4);
    show("direct3", &c);
    eval("  direct3", &norm.model(&c.projection));
        let pr = refined(&rpts, &c.inliers, None, 4).unwrap();
        eval("R direct3", &nr.model(&pr));
}

//! Rooms with white walls, on which neither features nor stereo find anything.
#![allow(clippy::unwrap_used)]

use depthstitch::pipeline::many::{ManyOptions, align_many};
use scene::{SIZE, codes, landing_errors, with_cameras};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

#[test]
fn white_walls_are_put_where_they_are() {
    let views = scene::room(4, SIZE.0, SIZE.1);
    let found = align_many(&with_cameras(&views, &[]), &ManyOptions::default(), &mut ()).unwrap();
    assert_eq!(codes(&found), ["used"; 4]);
    let [seen, alone] = landing_errors(&found, &views);
    // Without planes it is 6 px and 21 px.
    assert!(seen < 1.5 && alone < 2.0, "{seen} px where two photos see, {alone} px elsewhere");
}

//! Any bytes as a mesh, and the capsule about it.
#![no_main]

use cft_ident::config::vertices_of_mesh;
use cft_ident::robot::tree::capsule::of_pieces;
use cft_ident::robot::tree::enclosing::{BoundingBall, enclosing};
use cft_ident::robot::tree::space::UNTURNED;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok(vertices) = vertices_of_mesh("stl", bytes) else {
        return;
    };
    let balls: Vec<BoundingBall> = vertices.iter().map(|x| (*x, 0.0)).collect();
    let (ends, radius) = enclosing(&balls, &UNTURNED).expect("a mesh has a vertex");
    let largest = vertices.iter().flatten().fold(1.0, |most: f64, x| most.max(x.abs()));
    for vertex in &vertices {
        let off = of_pieces(&ends, &[*vertex; 2]) - radius;
        assert!(off <= 1e-6 + 1e-9 * largest, "a vertex is outside: {off}");
    }
});

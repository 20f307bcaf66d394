//! Meshes of a URDF's collision shapes: `new --urdf` writes capsules that hold them, and `excite --check` keeps those
//! apart.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use cft_ident::config::limits::CapsuleSection;
use cft_ident::config::{RobotFile, vertices_of_mesh};
use cft_ident::robot::tree::capsule::of_pieces;
use cft_ident::robot::tree::enclosing::{BoundingBall, enclosing};
use cft_ident::robot::tree::space::{UNTURNED, Vector, about, add, turn};
use predicates::str::contains;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Triangle = [Vector; 3];

/// The twelve triangles of a bar about the origin, turned about a skew axis and moved.
fn bar(half: Vector, angle: f64, at: Vector) -> Vec<Triangle> {
    let turned = about(&[0.6, 0.0, 0.8], angle);
    let corner = |k: usize| -> Vector {
        let side = |i: usize| if k >> i & 1 == 0 { -half[i] } else { half[i] };
        add(&at, &turn(&turned, &[side(0), side(1), side(2)]))
    };
    let faces = [
        [0, 1, 3, 2],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 3, 7, 5],
    ];
    let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
    let triangles = faces.into_iter().flat_map(halves);
    triangles.map(|corners| corners.map(corner)).collect()
}

fn binary_stl(triangles: &[Triangle]) -> Vec<u8> {
    let mut out = b"solid by some programs".to_vec();
    out.resize(80, b' ');
    out.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        out.extend([0; 12]);
        out.extend(
            triangle
                .iter()
                .flatten()
                .flat_map(|x| (*x as f32).to_le_bytes()),
        );
        out.extend([0; 2]);
    }
    out
}

fn ascii_stl(triangles: &[Triangle]) -> String {
    let mut out = "solid bar\n".to_owned();
    for triangle in triangles {
        out.push_str("facet normal 0 0 0\nouter loop\n");
        for [x, y, z] in triangle {
            let _ = writeln!(out, "vertex {x:e} {y:e} {z:e}");
        }
        out.push_str("endloop\nendfacet\n");
    }
    out + "endsolid bar\n"
}

/// Two links of 1 m and 0.5 m that turn about y on a post of 0.5 m with a wide foot.
fn arm(upper: &str, lower: &str) -> String {
    let joint = |name: &str, parent: &str, child: &str, xyz: &str, most: &str| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
             <origin xyz=\"{xyz}\"/><axis xyz=\"0 1 0\"/><limit lower=\"-{most}\" upper=\"{most}\" velocity=\"3\" effort=\"200\"/></joint>\n"
        )
    };
    let inertial =
        "<inertial><mass value=\"1\"/><inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.1\"/></inertial>";
    let foot = "<collision><origin xyz=\"0 0 0.2\"/><geometry><box size=\"0.9 0.7 0.4\"/></geometry></collision>";
    [
        "<robot name=\"arm\">\n".to_owned(),
        format!(
            "<link name=\"foot\">{foot}</link>\n<link name=\"upper\">{inertial}{upper}</link>\n"
        ),
        format!("<link name=\"lower\">{inertial}{lower}</link>\n"),
        joint("q1", "foot", "upper", "0 0 0.5", "1.5"),
        joint("q2", "upper", "lower", "1 0 0", "2.9"),
        "</robot>\n".to_owned(),
    ]
    .concat()
}

fn mesh(origin: &str, file: &str, more: &str) -> String {
    format!(
        "<collision><origin {origin}/><geometry><mesh filename=\"{file}\" {more}/></geometry></collision>"
    )
}

fn command(folder: &Path, line: &str) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("cft-ident").unwrap();
    command.current_dir(folder).args(line.split_whitespace());
    command.assert()
}

/// How far a point stands out of the nearest of some capsules \[m\].
fn outside(capsules: &[&CapsuleSection], point: &Vector) -> f64 {
    let each = capsules
        .iter()
        .map(|c| of_pieces(&[c.from, c.to], &[*point; 2]) - c.radius);
    each.fold(f64::INFINITY, f64::min)
}

#[test]
fn capsules_of_an_arm_hold_every_vertex_of_its_meshes_and_a_check_keeps_them_apart() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::create_dir_all(path("arm_description/urdf")).unwrap();
    fs::create_dir_all(path("arm_description/meshes")).unwrap();
    // in millimetres
    let long = bar([400.0, 30.0, 40.0], 0.0, [500.0, 0.0, 0.0]);
    fs::write(path("arm_description/meshes/upper.stl"), binary_stl(&long)).unwrap();
    // along its own y axis, which the <origin> turns onto the link's x axis
    let short = bar([0.02, 0.2, 0.02], 0.0, [0.0, -0.3, 0.0]);
    fs::write(path("arm_description/urdf/lower.STL"), ascii_stl(&short)).unwrap();
    let upper = mesh(
        "xyz=\"0 0 0\"",
        "package://arm_description/meshes/upper.stl",
        "scale=\"0.001 0.001 0.001\"",
    );
    let lower = mesh(
        "rpy=\"0 0 1.5707963267948966\" xyz=\"0 0.01 0\"",
        "lower.STL",
        "",
    );
    fs::write(path("arm_description/urdf/arm.urdf"), arm(&upper, &lower)).unwrap();
    command(
        folder.path(),
        "new arm --urdf arm_description/urdf/arm.urdf",
    )
    .success()
    .stderr(predicates::str::is_empty());
    let file = RobotFile::load(&path("arm.toml")).unwrap();
    let placed_long = long.iter().flatten().map(|x| x.map(|x| 1e-3 * x));
    let placed_short = short.iter().flatten().map(|[x, y, z]| [-y, 0.01 + x, *z]);
    let half_diagonals = [f64::hypot(0.03, 0.04), f64::hypot(0.02, 0.02)];
    for (link, vertices, half) in [
        (
            "upper",
            placed_long.collect::<Vec<Vector>>(),
            half_diagonals[0],
        ),
        ("lower", placed_short.collect(), half_diagonals[1]),
    ] {
        let capsules: Vec<&CapsuleSection> = file
            .limits
            .capsule
            .iter()
            .filter(|c| c.link == link)
            .collect();
        let [capsule] = capsules[..] else {
            panic!("{link}: {capsules:?}");
        };
        for vertex in &vertices {
            let off = outside(&[capsule], vertex);
            // vertices of the binary file are rounded to 24 bits
            assert!(off <= 1e-7, "{link}: {off} {vertex:?} {capsule:?}");
        }
        assert!(
            capsule.radius < 1.002 * half + 2e-6,
            "{link}: {capsule:?} {half}"
        );
    }
    assert_eq!(file.limits.touching.len(), 0);
    // q1 nods by 0.3 rad; folded, the lower link comes down onto the foot
    let motion = |name: &str, q2: &str| {
        let text = format!(
            "kind = \"fourier\"\ncoordinates = \"joint\"\nfundamental_hz = 0.2\nperiods = 2\nblend_s = 5.0\n\
             [[coordinate]]\nname = \"q1\"\noffset = 0.0\na = [0.3769911184307752]\nb = [0.0]\n\
             [[coordinate]]\nname = \"q2\"\noffset = {q2}\na = [0.0]\nb = [0.0]\n"
        );
        fs::write(path(name), text).unwrap();
    };
    motion("straight.toml", "0.0");
    motion("folded.toml", "2.8");
    command(folder.path(), "excite -r arm.toml --check straight.toml").code(0);
    command(folder.path(), "excite -r arm.toml --check folded.toml")
        .code(1)
        .stderr(contains("distance of base to lower runs from -"));
}

#[test]
fn pieces_of_a_link_are_held_and_those_that_are_not_there_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    // an angle: two bars that one capsule would hold with much room
    let (one, other) = (
        bar([0.5, 0.02, 0.02], 0.0, [0.5, 0.0, 0.0]),
        bar([0.02, 0.02, 0.3], 0.1, [1.0, 0.0, 0.3]),
    );
    fs::write(path("one.stl"), ascii_stl(&one)).unwrap();
    fs::write(path("other.STL"), binary_stl(&other)).unwrap();
    fs::write(path("hand.dae"), "<COLLADA/>").unwrap();
    let plain = "xyz=\"0 0 0\"";
    let upper = mesh(plain, "one.stl", "") + &mesh(plain, "file://other.STL", "");
    // a bar in two halves
    let halves = [0.1, 0.3].map(|x| bar([0.1, 0.02, 0.02], 0.0, [x, 0.0, 0.0]));
    fs::write(path("half_0.stl"), binary_stl(&halves[0])).unwrap();
    fs::write(path("half_1.stl"), ascii_stl(&halves[1])).unwrap();
    let lower = mesh(plain, "half_0.stl", "") + &mesh(plain, "half_1.stl", "");
    let lost = mesh(plain, "package://elsewhere/hand.stl", "")
        + &mesh(plain, "other.STL", "scale=\"1e30 1 1\"")
        + &mesh(plain, "hand.dae", "");
    fs::write(path("arm.urdf"), arm(&upper, &(lower.clone() + &lost))).unwrap();
    let run = command(folder.path(), "new arm --urdf arm.urdf -v").success();
    run.stderr(contains(
        "collision shapes that no capsule holds: lower: package://elsewhere/hand.stl is in no folder of its package",
    ))
    .stderr(contains("other.STL: vertices beyond 1e30 m; and 1 more of the kind; put the files"));
    // a file of another kind says so, with what to do
    let strange = mesh(plain, "hand.dae", "");
    fs::write(path("dae.urdf"), arm(&upper, &(lower.clone() + &strange))).unwrap();
    command(folder.path(), "new dae --urdf dae.urdf -v")
        .success()
        .stderr(contains("hand.dae: is no STL file; convert it to STL"));
    let text = fs::read_to_string(path("arm.toml")).unwrap();
    assert!(
        text.contains("# CHECK IT: not all collision shapes of lower could be read"),
        "{text}"
    );
    let file = RobotFile::load(&path("arm.toml")).unwrap();
    let of = |link: &str| -> Vec<&CapsuleSection> {
        file.limits
            .capsule
            .iter()
            .filter(|c| c.link == link)
            .collect()
    };
    for (link, meshes, count) in [
        ("upper", [&one, &other], 2),
        ("lower", [&halves[0], &halves[1]], 1),
    ] {
        let capsules = of(link);
        assert_eq!(capsules.len(), count, "{capsules:?}");
        for vertex in meshes.into_iter().flatten().flatten() {
            let off = outside(&capsules, vertex);
            assert!(off <= 1e-7, "{link}: {off} {vertex:?}");
        }
    }
}

#[test]
fn more_shapes_than_a_robot_file_takes_are_held_link_by_link() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    // beads far apart, which no common capsule holds as tightly
    let bead = bar([0.001, 0.001, 0.001], 0.3, [0.0; 3]);
    fs::write(path("bead.stl"), ascii_stl(&bead)).unwrap();
    let at = |k: u32| [f64::from(k % 10) * 0.1, f64::from(k / 10) * 0.1, 0.0];
    let beads = (0..70).map(|k| {
        mesh(
            &format!("xyz=\"{} {} 0\"", at(k)[0], at(k)[1]),
            "bead.stl",
            "",
        )
    });
    fs::write(path("arm.urdf"), arm(&beads.collect::<String>(), "")).unwrap();
    command(folder.path(), "new arm --urdf arm.urdf").success();
    let file = RobotFile::load(&path("arm.toml")).unwrap();
    let capsules: Vec<&CapsuleSection> = file
        .limits
        .capsule
        .iter()
        .filter(|c| c.link == "upper")
        .collect();
    assert_eq!(capsules.len(), 1);
    for vertex in bead.iter().flatten() {
        assert!((0..70).all(|k| outside(&capsules, &add(vertex, &at(k))) <= 1e-7));
    }
}

/// Bits, bytes, words and lengths that a good file may be spoiled by; what is read still has its capsule.
#[test]
fn no_bytes_of_a_mesh_panic_and_what_is_read_is_held() {
    let bar = bar([0.3, 0.1, 0.05], 0.7, [1.0, 2.0, 3.0]);
    let good = [binary_stl(&bar), ascii_stl(&bar).into_bytes()];
    let words = [
        "nan", "1e30", "-1e30", "1e31", "1e-320", "0", "solid", "vertex", "\u{202e}",
    ];
    let mut chance = ChaCha8Rng::seed_from_u64(11);
    let mut read = [0; 2];
    for case in 0..4000 {
        let mut bytes = good[case % 2].clone();
        for _ in 0..chance.random_range(1..4) {
            let at = chance.random_range(0..bytes.len());
            match chance.random_range(0..6) {
                0 => bytes.truncate(at.max(1)),
                1 => bytes[at] ^= 1 << chance.random_range(0..8),
                2 => bytes[at] = chance.random_range(0..=255),
                3 => drop(bytes.splice(at..at, bytes[at / 2..at].to_vec())),
                _ => {
                    let word = words[chance.random_range(0..words.len())];
                    let end = (at + chance.random_range(0..12)).min(bytes.len());
                    bytes.splice(at..end, word.bytes());
                }
            }
        }
        let Ok(vertices) = vertices_of_mesh("stl", &bytes) else {
            continue;
        };
        read[case % 2] += 1;
        let balls: Vec<BoundingBall> = vertices.iter().map(|x| (*x, 0.0)).collect();
        let (ends, radius) = enclosing(&balls, &UNTURNED).expect("a mesh has a vertex");
        let largest = vertices
            .iter()
            .flatten()
            .fold(1.0, |most: f64, x| most.max(x.abs()));
        for vertex in &vertices {
            let off = of_pieces(&ends, &[*vertex; 2]) - radius;
            assert!(
                off <= 1e-6 + 1e-9 * largest,
                "case {case}: {off} {vertex:?}"
            );
        }
    }
    // some of each are still meshes, and most are not
    assert!(
        read.iter().all(|read| (50..1500).contains(read)),
        "{read:?}"
    );
}

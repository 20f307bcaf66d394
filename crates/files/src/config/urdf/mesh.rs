//! Vertices of the meshes that a URDF names: where their files are, and what STL files hold.

use std::borrow::Cow;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::config::text_file::text_of;
use cft_ident_core::number::is_usable;
use cft_ident_core::robot::tree::space::Vector;
use cft_ident_logs::log::{escape, remedy, shown};

/// Largest file of a mesh. Those for collisions have some hundred kB, those that are shown some MB.
const MOST_BYTES: u64 = 64 << 20;
/// How much is read of all the meshes of one URDF, which may name a file as often as it likes.
pub(super) const MOST_BYTES_OF_ALL: u64 = 128 << 20;

/// Head of a binary STL file and its number of triangles; a triangle: normal, vertices, and two bytes of colour.
const HEAD: usize = 80;
const COUNT: usize = HEAD + 4;
const TRIANGLE: usize = 50;

/// Vertices of the mesh that a URDF in `folder` names, in units of the file \[m\]; what is read is taken from `left`.
pub(super) fn read(named: &str, folder: &Path, left: &mut u64) -> Result<Vec<Vector>, String> {
    let places = places(named.trim(), folder);
    let Some(path) = places.iter().find(|path| path.is_file()) else {
        return Err(match &places[..] {
            [alone] => format!("there is no file {}", shown(alone)),
            _ => format!(
                "{} is in no folder of its package beside the URDF or above it",
                escape(named)
            ),
        });
    };
    let of_file = |problem: &str| format!("{}: {problem}", shown(path));
    let failed = |error: std::io::Error| of_file(&format!("{error}; {}", remedy(&error)));
    let file = std::fs::File::open(path).map_err(failed)?;
    let size = file.metadata().map_err(failed)?.len();
    if size > MOST_BYTES {
        return Err(of_file("more than 64 MB; give a coarser mesh"));
    }
    if size > *left {
        return Err(of_file("the meshes of this URDF have more than 128 MB"));
    }
    let mut bytes = Vec::new();
    let got = file.take(size).read_to_end(&mut bytes).map_err(failed)?;
    *left -= got as u64;
    let format = path.extension().unwrap_or_default().to_string_lossy();
    vertices(&format, &bytes).map_err(|problem| of_file(&problem))
}

/// Where a mesh may be: from the URDF's folder on, or in its package (by name or package.xml) beside or above that.
fn places(named: &str, folder: &Path) -> Vec<PathBuf> {
    if let Some(path) = named.strip_prefix("file://") {
        return vec![folder.join(path)];
    }
    let in_package = named.strip_prefix("package://");
    let Some(in_package) = in_package.or_else(|| named.strip_prefix("model://")) else {
        let beside = folder.join(named);
        return vec![
            beside
                .strip_prefix(".")
                .map_or(beside.clone(), Path::to_owned),
        ];
    };
    let (package, rest) = in_package.split_once('/').unwrap_or((in_package, ""));
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let mut places = Vec::new();
    for above in folder.ancestors() {
        let own = above.file_name().is_some_and(|name| name == package);
        if own || package_of(above).is_some_and(|name| name == package) {
            places.push(above.join(rest));
        }
        places.push(above.join(package).join(rest));
    }
    places
}

/// Name of the ROS package in a folder.
fn package_of(folder: &Path) -> Option<String> {
    let path = folder.join("package.xml");
    let text = path.is_file().then(|| text_of(&path).ok())??;
    let (_, name) = text.split_once("<name>")?;
    let (name, _) = name.split_once("</name>")?;
    Some(name.trim().to_owned())
}

/// Vertices of a mesh from the bytes of an STL file; `format` is the ending of its name.
///
/// # Errors
/// What is wrong with the bytes.
pub fn vertices(format: &str, bytes: &[u8]) -> Result<Vec<Vector>, String> {
    if !format.eq_ignore_ascii_case("stl") {
        return Err(
            "is no STL file; convert it to STL, which a mesh for collisions mostly is".to_owned(),
        );
    }
    let found = stl(bytes)?;
    match found.is_empty() {
        true => Err("holds no vertex".to_owned()),
        false => Ok(found),
    }
}

fn stl(bytes: &[u8]) -> Result<Vec<Vector>, String> {
    const CUT_OFF: &str = "the file is cut off; export it anew";
    let number = bytes.get(HEAD..COUNT).and_then(|n| n.try_into().ok());
    let triangles = number.map(u32::from_le_bytes).map(u64::from);
    let body = bytes.get(COUNT..).unwrap_or_default();
    let room = triangles.map(|n| n * TRIANGLE as u64);
    let start = bytes.trim_ascii_start().get(..5).unwrap_or_default();
    // heads of binary files begin with this word too: then the length says
    if start.eq_ignore_ascii_case(b"solid") && room != Some(body.len() as u64) {
        let vertices = listed(bytes)?;
        let last = bytes.trim_ascii_end().rsplit(|b| *b == b'\n').next();
        let last = last.unwrap_or_default().trim_ascii_start();
        let ends = last.get(..8).unwrap_or_default();
        return match vertices.len() % 3 == 0 && ends.eq_ignore_ascii_case(b"endsolid") {
            true => Ok(vertices),
            false => Err(CUT_OFF.to_owned()),
        };
    }
    if room.is_none_or(|room| room > body.len() as u64) {
        return Err(format!("no STL: {CUT_OFF}"));
    }
    let all = body
        .chunks_exact(TRIANGLE)
        .take(triangles.unwrap_or_default() as usize);
    let mut out = Vec::new();
    for (k, triangle) in all.enumerate() {
        for vertex in triangle[12..48].chunks_exact(12) {
            let number = |i: usize| {
                let bytes = vertex[4 * i..].first_chunk().copied().unwrap_or_default();
                f64::from(f32::from_le_bytes(bytes))
            };
            let vertex: Vector = std::array::from_fn(number);
            if !vertex.iter().all(|x| is_usable(*x)) {
                return Err(format!("triangle {} has a vertex at {vertex:?}", k + 1));
            }
            out.push(vertex);
        }
    }
    Ok(out)
}

/// The three numbers of each line that begins with `vertex`.
fn listed(bytes: &[u8]) -> Result<Vec<Vector>, String> {
    let mut out = Vec::new();
    for (k, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let line: Cow<str> = String::from_utf8_lossy(line);
        let mut words = line.split_ascii_whitespace();
        if !words
            .next()
            .is_some_and(|word| word.eq_ignore_ascii_case("vertex"))
        {
            continue;
        }
        let mut number = || {
            let number: Option<f64> = words.next()?.parse().ok();
            number.filter(|x| is_usable(*x))
        };
        let (Some(x), Some(y), Some(z)) = (number(), number(), number()) else {
            let line = escape(line.trim());
            return Err(format!(
                "line {}: `{line}` has not three finite numbers",
                k + 1
            ));
        };
        out.push([x, y, z]);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const FACET: &str = "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  VERTEX 1.5 0 0\n  vertex 0 -2e-1 3\n endloop\nendfacet\n";
    const CORNERS: [Vector; 3] = [[0.0; 3], [1.5, 0.0, 0.0], [0.0, -0.2, 3.0]];

    fn binary(head: &str, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut out = head.as_bytes().to_vec();
        out.resize(HEAD, 0);
        out.extend((triangles.len() as u32).to_le_bytes());
        for triangle in triangles {
            out.extend([0; 12]);
            out.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
            out.extend([0; 2]);
        }
        out
    }

    #[test]
    fn stl_is_read_from_text_and_from_bytes_whatever_word_the_head_begins_with() {
        let text = format!("solid a b\r\n{FACET}endsolid a b\n");
        assert_eq!(vertices("STL", text.as_bytes()).unwrap(), CORNERS);
        let corners = [[[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, -0.25, 3.0]]];
        let expected = [[0.0; 3], [1.5, 0.0, 0.0], [0.0, -0.25, 3.0]];
        for head in ["made by hand", "solid made by hand"] {
            let bytes = binary(head, &corners);
            assert_eq!(vertices("stl", &bytes).unwrap(), expected, "{head}");
            let cut = vertices("stl", &bytes[..bytes.len() - 1]).unwrap_err();
            assert!(cut.contains("cut off"), "{cut}");
        }
        let wrong = |bytes: &[u8]| vertices("stl", bytes).unwrap_err();
        assert!(wrong(format!("solid\n{FACET}").as_bytes()).contains("cut off"));
        assert!(wrong(b"version https://git-lfs").contains("no STL"));
        assert_eq!(wrong(b"solid\nendsolid"), "holds no vertex");
        let bent = text.replace("-2e-1", "nan");
        let described = "line 6: `vertex 0 nan 3` has not three finite numbers";
        assert_eq!(wrong(bent.as_bytes()), described);
        let bent = binary("", &[[[0.0, f32::INFINITY, 0.0]; 3]]);
        assert_eq!(wrong(&bent), "triangle 1 has a vertex at [0.0, inf, 0.0]");
    }

    #[test]
    fn other_formats_are_to_be_converted() {
        for format in ["obj", "dae", "ply", ""] {
            let problem = vertices(format, b"v 0 0 0").unwrap_err();
            assert!(problem.contains("convert it to STL"), "{problem}");
        }
    }

    #[test]
    fn meshes_are_found_beside_the_urdf_and_in_packages_beside_and_above_it() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        let urdf = root.join("arm-main/urdf");
        for made in ["arm-main/urdf", "arm-main/meshes", "hand_description"] {
            fs::create_dir_all(root.join(made)).unwrap();
        }
        let text = format!("solid\n{FACET}endsolid\n");
        for file in ["arm-main/meshes/a.stl", "hand_description/a.stl"] {
            fs::write(root.join(file), &text).unwrap();
        }
        let about = "<package>\n <name> arm_description </name>\n</package>";
        fs::write(root.join("arm-main/package.xml"), about).unwrap();
        let whole = format!("file://{}", root.join("hand_description/a.stl").display());
        let mut left = 1000;
        for named in [
            "../meshes/a.stl",
            "package://arm_description/meshes/a.stl",
            "package://arm-main/meshes/a.stl",
            "package://hand_description/a.stl",
            "model://hand_description/a.stl",
            &whole,
        ] {
            assert_eq!(read(named, &urdf, &mut left).unwrap(), CORNERS, "{named}");
        }
        assert_eq!(left, 1000 - 6 * text.len() as u64);
        let mut wrong = |named: &str| read(named, &urdf, &mut left).unwrap_err();
        let there = urdf.join("b.stl");
        assert_eq!(
            wrong("b.stl"),
            format!("there is no file {}", shown(&there))
        );
        assert!(wrong("../meshes").contains("there is no file"));
        assert!(wrong("package://other/a.stl").contains("a.stl is in no folder of its package"));
        fs::File::create(&there)
            .unwrap()
            .set_len(MOST_BYTES + 1)
            .unwrap();
        assert!(wrong("b.stl").contains("more than 64 MB"));
        let mut left = text.len() as u64 - 1;
        let more = read("../meshes/a.stl", &urdf, &mut left).unwrap_err();
        assert!(more.contains("the meshes of this URDF"), "{more}");
    }
}

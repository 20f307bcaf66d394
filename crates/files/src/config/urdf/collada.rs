//! Vertices of a COLLADA file: the geometries of its scene, each as its nodes place it.

use std::collections::BTreeMap;

use super::xml::{self, Element};
use cft_ident_core::number::is_usable;
use cft_ident_core::robot::tree::space::{
    Rotation, UNTURNED, Vector, about, add, dot, product, times, turn,
};

/// Most nodes of a scene, those that stand for others counted as often as they are met.
const MOST_NODES: usize = 10_000;
/// Most numbers of positions, those of a geometry counted as often as it is shown.
const MOST_NUMBERS: usize = 1 << 24;

/// A x + b; A need not be a rotation.
type Affine = (Rotation, Vector);

/// The vertices of the scene \[m\], `up_axis` aside: RViz and MoveIt pass over it, and URDFs look right there.
pub(super) fn vertices(text: &str) -> Result<Vec<Vector>, String> {
    let text = xml::without_comments(text);
    let tree = xml::Tree::parse(&text).map_err(|e| format!("line {}: {}", e.line, e.problem))?;
    let root = tree.root();
    if root.name() != "COLLADA" {
        return Err("has no <COLLADA>".to_owned());
    }
    let named = root.descendants();
    let ids: BTreeMap<&str, Element> = named
        .filter_map(|element| Some((element.attribute("id")?, element)))
        .collect();
    // `#name`, or the name alone as inputs of old files have it
    let find = |element: Element, key: &str| {
        let name = element.attribute(key).unwrap_or_default();
        ids.get(name.strip_prefix('#').unwrap_or(name))
            .copied()
            .ok_or_else(|| {
                let line = element.line();
                format!(
                    "line {line}: <{}> names nothing of this file",
                    element.name()
                )
            })
    };
    let unit = root.child("asset").and_then(|asset| asset.child("unit"));
    let unit = match unit.and_then(|unit| Some((unit, unit.attribute("meter")?))) {
        None => 1.0,
        Some((unit, text)) => numbers::<1>(unit, text)?[0],
    };
    let scene = root
        .child("scene")
        .and_then(|scene| scene.child("instance_visual_scene"));
    let scene = find(scene.ok_or("shows no scene")?, "url")?;
    let scaled = UNTURNED.map(|row| times(unit, &row));
    let mut open: Vec<(Element, Affine)> = vec![(scene, (scaled, [0.0; 3]))];
    let (mut nodes, mut left, mut out) = (0, MOST_NUMBERS, Vec::new());
    while let Some((node, around)) = open.pop() {
        nodes += 1;
        if nodes > MOST_NODES {
            return Err(format!(
                "more than {MOST_NODES} nodes, or nodes in a circle"
            ));
        }
        let mut here = around;
        for child in node.children() {
            match child.name() {
                "matrix" | "translate" | "rotate" | "scale" => here = after(&here, &step(child)?),
                "lookat" | "skew" | "instance_controller" => {
                    let (line, name) = (child.line(), child.name());
                    return Err(format!(
                        "line {line}: <{name}> is not known here; apply it first"
                    ));
                }
                "node" => open.push((child, here)),
                "instance_node" => open.push((find(child, "url")?, here)),
                "instance_geometry" => {
                    let of = positions(find(child, "url")?, &find, &mut left)?;
                    out.extend(of.iter().map(|x| add(&here.1, &turn(&here.0, x))));
                }
                _ => {}
            }
        }
    }
    Ok(out)
}

/// First b, then a.
fn after(a: &Affine, b: &Affine) -> Affine {
    (product(&a.0, &b.0), add(&a.1, &turn(&a.0, &b.1)))
}

/// A transformation of a node.
fn step(element: Element) -> Result<Affine, String> {
    let text = element.text();
    Ok(match element.name() {
        "translate" => (UNTURNED, numbers::<3>(element, text)?),
        "scale" => {
            let [x, y, z] = numbers::<3>(element, text)?;
            ([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]], [0.0; 3])
        }
        "rotate" => {
            let [x, y, z, degrees] = numbers::<4>(element, text)?;
            let length = dot(&[x, y, z], &[x, y, z]).sqrt();
            match length > 0.0 {
                true => {
                    let axis = times(1.0 / length, &[x, y, z]);
                    (about(&axis, degrees.to_radians()), [0.0; 3])
                }
                false => (UNTURNED, [0.0; 3]),
            }
        }
        _ => {
            let rows = numbers::<16>(element, text)?;
            let row = |i: usize| [rows[4 * i], rows[4 * i + 1], rows[4 * i + 2]];
            ([row(0), row(1), row(2)], [rows[3], rows[7], rows[11]])
        }
    })
}

/// Positions of the vertices of a `<geometry>`; their numbers are taken from `left`.
fn positions<'a, 't>(
    geometry: Element<'a, 't>,
    find: &impl Fn(Element<'a, 't>, &str) -> Result<Element<'a, 't>, String>,
    left: &mut usize,
) -> Result<Vec<Vector>, String> {
    let wrong = |what: &str| format!("line {}: <geometry> {what}", geometry.line());
    let vertices = geometry
        .child("mesh")
        .and_then(|mesh| mesh.child("vertices"));
    let inputs = vertices.into_iter().flat_map(Element::children);
    let mut inputs = inputs.filter(|input| input.attribute("semantic") == Some("POSITION"));
    let input = inputs
        .next()
        .ok_or_else(|| wrong("has no vertices of a mesh"))?;
    let source = find(input, "source")?;
    let array = source
        .child("float_array")
        .ok_or_else(|| wrong("has no numbers"))?;
    let accessor = source
        .child("technique_common")
        .and_then(|common| common.child("accessor"));
    let whole = |key: &str, usual: usize| -> usize {
        let value = accessor.and_then(|accessor| accessor.attribute(key)?.trim().parse().ok());
        value.unwrap_or(usual)
    };
    let (stride, offset) = (whole("stride", 3), whole("offset", 0));
    let all = array.text().split_ascii_whitespace().map(usable);
    let all: Option<Vec<f64>> = all.collect();
    let all = all.ok_or_else(|| wrong("has numbers that are not finite"))?;
    let too_many = || format!("more than {MOST_NUMBERS} numbers of positions");
    *left = left.checked_sub(all.len()).ok_or_else(too_many)?;
    let body = all.get(offset..).unwrap_or_default();
    if stride < 3 || body.len() % stride != 0 {
        return Err(wrong("has vertices of fewer than three numbers"));
    }
    let vertices = body.chunks_exact(stride);
    Ok(vertices.map(|x| [x[0], x[1], x[2]]).collect())
}

fn usable(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x| is_usable(*x))
}

fn numbers<const N: usize>(element: Element, text: &str) -> Result<[f64; N], String> {
    let all: Option<Vec<f64>> = text.split_ascii_whitespace().map(usable).collect();
    let all = all.and_then(|all| all.try_into().ok());
    all.ok_or_else(|| {
        let (line, name) = (element.line(), element.name());
        format!("line {line}: <{name}> wants {N} finite numbers")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two vertices; `nodes` stand in the scene.
    fn file(nodes: &str) -> String {
        format!(
            "<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n\
             <asset><unit name=\"millimeter\" meter=\"0.001\"/><up_axis>Y_UP</up_axis></asset>\n\
             <library_geometries><geometry id=\"g\"><mesh>\n\
             <source id=\"n\"><float_array id=\"na\" count=\"3\">9 9 9</float_array></source>\n\
             <source id=\"p\"><float_array id=\"pa\" count=\"6\">1 2 3\n 10 20 30</float_array>\n\
             <technique_common><accessor source=\"#pa\" count=\"2\" stride=\"3\"/></technique_common></source>\n\
             <vertices id=\"v\"><input semantic=\"NORMAL\" source=\"#n\"/><input semantic=\"POSITION\" source=\"#p\"/></vertices>\n\
             </mesh></geometry></library_geometries>\n\
             <library_nodes><node id=\"far\"><translate>0 0 1000</translate><instance_geometry url=\"#g\"/></node></library_nodes>\n\
             <library_visual_scenes><visual_scene id=\"s\">\n{nodes}\n</visual_scene></library_visual_scenes>\n\
             <scene><instance_visual_scene url=\"#s\"/></scene>\n</COLLADA>\n"
        )
    }

    #[test]
    fn vertices_stand_where_the_nodes_of_the_scene_put_them() {
        let shown = "<instance_geometry url=\"#g\"/>";
        for (node, expected) in [
            (format!("<node>{shown}</node>"), [0.001, 0.002, 0.003]),
            (
                format!(
                    "<node><matrix>2 0 0 100  0 2 0 0  0 0 2 0  0 0 0 1</matrix>{shown}</node>"
                ),
                [0.102, 0.004, 0.006],
            ),
            // the last transformation comes first, those of the node around it after
            (
                format!(
                    "<node><translate>1000 0 0</translate><rotate>0 0 2 90</rotate><scale>1 1 2</scale>\
                     <node><translate>0 0 5</translate>{shown}</node></node>"
                ),
                [0.998, 0.001, 0.016],
            ),
            (
                "<node><instance_node url=\"#far\"/></node>".to_owned(),
                [0.001, 0.002, 1.003],
            ),
        ] {
            let found = vertices(&file(&node)).unwrap();
            assert_eq!(found.len(), 2);
            for (a, b) in found[0].iter().zip(expected) {
                assert!((a - b).abs() < 1e-12, "{node}: {found:?}");
            }
        }
    }

    #[test]
    fn what_is_not_known_or_has_no_end_is_reported() {
        let shown = "<node><instance_geometry url=\"#g\"/></node>";
        let circle = "<node id=\"c\"><instance_node url=\"#c\"/><instance_node url=\"#c\"/></node>";
        for (text, described) in [
            (
                file("<node><instance_geometry url=\"#h\"/></node>"),
                "line 13: <instance_geometry> names nothing",
            ),
            (
                file("<node><skew>1 2 3 4 5 6 7</skew></node>"),
                "line 13: <skew> is not known",
            ),
            (
                file("<node><rotate>1 2 3</rotate></node>"),
                "line 13: <rotate> wants 4 finite numbers",
            ),
            (file(circle), "nodes in a circle"),
            (
                file(shown).replace("10 20 30", "10 20"),
                "fewer than three numbers",
            ),
            (file(shown).replace("10 20 30", "10 20 1e31"), "not finite"),
            (
                file(shown).replace("POSITION", "COLOR"),
                "has no vertices of a mesh",
            ),
            (
                file(shown).replace("url=\"#s\"", ""),
                "names nothing of this file",
            ),
            (file(shown).replace("</COLLADA>", ""), "cut off"),
            ("<robot/>".to_owned(), "has no <COLLADA>"),
        ] {
            let found = vertices(&text).unwrap_err();
            assert!(found.contains(described), "{described}: {found}");
        }
        let many = shown.repeat(MOST_NODES);
        assert!(
            vertices(&file(&many))
                .unwrap_err()
                .contains("more than 10000 nodes")
        );
    }
}

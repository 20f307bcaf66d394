//! URDF files that cannot be used: each error names file, line and the way out, and none panics.

use cft_ident_files::config::{ChainRequest, RobotFile, UrdfChain};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;
use std::path::Path;

/// A two-link arm; `more` stands at its end, from line 6 on.
fn arm(more: &str) -> String {
    format!(
        "<robot name=\"r\">\n<link name=\"base\"/><link name=\"a\"/><link name=\"b\"/>\n\
         <joint name=\"j1\" type=\"revolute\"><parent link=\"base\"/><child link=\"a\"/></joint>\n\
         <joint name=\"j2\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/></joint>\n\n{more}\n</robot>\n"
    )
}

fn error(text: &str) -> String {
    let error = UrdfChain::parse("r.urdf", text, None).unwrap_err();
    error.to_string()
}

/// A URDF a line that is refused, whole or at the end of the arm, and how its error begins.
const REFUSED: &str = r#"
arm | </link> | r.urdf:6: no well-formed XML
whole | <robot name='r'>\n<link name='a'/>\n | r.urdf:3: the text ends inside <robot> of line 1; the file is cut off
whole | <!DOCTYPE robot [<!ENTITY x "y">]>\n<robot/> | r.urdf:1: a document type
arm | <link name="&big;"/> | r.urdf:6: <link>:
whole |  | r.urdf:1: no element at all
whole | <sdf><model/></sdf> | r.urdf:1: `<sdf>` is not the <robot> of a URDF
arm | <xacro:arm/> | r.urdf:6: `<xacro:arm>` is a macro of xacro, not yet expanded; expand it first
whole | <robot/> | r.urdf:1: `<robot>` has no <link>
whole | <robot><link name="a"/></robot> | r.urdf:1: `link a` has no moving joint behind it
arm | <link name="a"/> | r.urdf:6: `link a` has the name of that of line 2
arm | <joint name="j2" type="fixed"/> | r.urdf:6: `joint j2` has the name of that of line 4
arm | <link/> | r.urdf:6: `<link>` has no name
arm | <link name="c"/> | r.urdf:6: `link c` is a second root beside `base`; join the two
arm | <joint name="j3" type="revolute"><parent link="b"/><child link="bb"/></joint> | r.urdf:6: `joint j3` has the child `bb`, which is no link;
arm | <joint name="j3" type="revolute"><parent link="b"/><child link="a"/></joint> | r.urdf:6: `joint j3` moves the link `a`, which hangs on joint `j1` already
arm | <link name="c"/><link name="d"/>\n<joint name="j3" type="fixed"><parent link="c"/><child link="d"/></joint>\n<joint name="j4" type="fixed"><parent link="d"/><child link="c"/></joint> | r.urdf:6: `link c` hangs on itself through its joints
arm | <link name="c"/>\n<joint name="j3" type="hinge"/> | r.urdf:7: `joint j3` has the type `hinge`; give revolute
arm | <link name="c"/>\n<joint name="j3" type="floating"><parent link="b"/><child link="c"/></joint> | r.urdf:7: `joint j3` is floating or planar
arm | <link name="c"/>\n<joint name="j3" type="revolute"><parent link="b"/></joint> | r.urdf:7: `joint j3` has no <child>; add <child .../> to it
arm | <link name="c"/>\n<joint name="j3" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 0"/></joint> | r.urdf:7: `joint j3` has an axis without length
arm | <link name="c"/>\n<joint name="j3" type="revolute"><parent link="b"/><child link="c"/>\n<origin xyz="0 0"/></joint> | r.urdf:8: `joint j3` has xyz="0 0" in <origin>; give three finite numbers
arm | <link name="c"/>\n<joint name="j3" type="revolute"><parent link="b"/><child link="c"/>\n<limit lower="1" upper="0"/></joint> | r.urdf:8: `joint j3` has the lower limit 1 above the upper 0
arm | <link name="c">\n<inertial>\n<mass value="nan"/><inertia ixx="0" iyy="0" izz="0"/></inertial></link> | r.urdf:8: `link c` has value="nan" in <mass>; give a finite number
arm | <link name="c"><inertial><mass value="1,5"/></inertial></link> | r.urdf:6: `link c` has value="1,5" in <mass>
arm | <link name="c"><inertial>\n<mass value="1"/></inertial></link> | r.urdf:6: `link c` has no <inertia>
arm | <link name="c"/>\n<joint name="j3" type="revolute"><parent link="b"/><child link="c"/><mimic joint="j9"/></joint> | r.urdf:7: `joint j3` mimics `j9`, which is no moving joint of this chain; let it mimic one of j1, j2
arm | <link name="c"/>\n<joint name="j3" type="revolute"><parent link="b"/><child link="c"/><mimic joint="j3"/></joint> | r.urdf:7: `joint j3` mimics itself through other joints
"#;

#[test]
fn a_urdf_that_cannot_be_read_is_refused_with_line_and_remedy() {
    for case in REFUSED.trim().lines() {
        let parts: Vec<&str> = case.split(" | ").collect();
        let [kind, text, wanted] = parts[..] else {
            panic!("{case}");
        };
        let text = text.replace("\\n", "\n");
        let got = match kind {
            "arm" => error(&arm(&text)),
            _ => error(&text),
        };
        assert!(got.starts_with(wanted), "{got}\nand not\n{wanted}");
        assert!(got.contains("; "), "no way out: {got}");
    }
}

#[test]
fn a_circle_without_any_root_is_reported() {
    let text = "<robot><link name=\"a\"/><link name=\"b\"/>\
        <joint name=\"j1\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/></joint>\
        <joint name=\"j2\" type=\"revolute\"><parent link=\"b\"/><child link=\"a\"/></joint></robot>";
    assert!(error(text).contains("`link a` hangs on itself"));
    let to_tip = UrdfChain::parse("r.urdf", text, Some("b")).unwrap_err();
    assert!(to_tip.to_string().contains("`link b` hangs on itself"));
}

#[test]
fn absurd_depth_and_length_end_in_errors_and_soon() {
    let deep = format!(
        "<robot>{}{}</robot>",
        "<x>".repeat(300_000),
        "</x>".repeat(300_000)
    );
    assert!(error(&deep).contains("nested more than 64 deep"));
    let wide = format!("<robot>{}</robot>", "<x/>".repeat(300_000));
    assert!(error(&wide).contains("more than 200000 elements"));
    // a chain of ten thousand fixed joints is no harm, one of moving joints is reported
    for (kind, wanted) in [
        ("fixed", "has no moving joint"),
        ("revolute", "more than 200 that move"),
    ] {
        let mut text = String::from("<robot><link name=\"l0\"/>");
        for i in 0..10_000 {
            let _ = write!(
                text,
                "<link name=\"l{}\"/><joint name=\"j{i}\" type=\"{kind}\"><parent link=\"l{i}\"/><child link=\"l{}\"/></joint>",
                i + 1,
                i + 1
            );
        }
        text.push_str("</robot>");
        assert!(error(&text).contains(wanted));
    }
}

#[test]
fn the_keys_of_the_robot_file_are_checked() {
    let head = "[robot]\nmodel = \"serial\"\n";
    let parse = |text: &str| {
        RobotFile::parse_in("r.toml", text, Some(Path::new("/nowhere")))
            .unwrap_err()
            .to_string()
    };
    let got = parse(&format!("{head}tip = \"a\"\n"));
    assert!(
        got.starts_with("r.toml:3: `robot.tip` stands without a `urdf`; "),
        "{got}"
    );
    let got = parse(&format!(
        "{head}urdf = \"a.urdf\"\n[[robot.link]]\njoint = \"q1\"\n"
    ));
    assert!(
        got.starts_with("r.toml:3: `robot.urdf` stands beside [[robot.link]] tables; "),
        "{got}"
    );
    let got = parse(&format!("{head}urdf = \"a.urdf\"\n"));
    assert!(
        got.starts_with("/nowhere/a.urdf: cannot be read: "),
        "{got}"
    );
    let got = parse("[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\nurdf = \"a.urdf\"\n");
    assert!(
        got.contains("`robot.urdf` does not belong to this model"),
        "{got}"
    );
    let alone = RobotFile::parse("r.toml", &format!("{head}urdf = \"a.urdf\"\n")).unwrap_err();
    assert!(
        alone
            .to_string()
            .starts_with("r.toml:3: `robot.urdf` names a file"),
        "{alone}"
    );
}

#[test]
fn a_file_that_is_huge_or_no_text_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let huge = folder.path().join("huge.urdf");
    std::fs::File::create(&huge)
        .unwrap()
        .set_len(1 << 33)
        .unwrap();
    let got = UrdfChain::load(&huge, &ChainRequest::default())
        .unwrap_err()
        .to_string();
    assert!(got.contains("more than 16 MB"), "{got}");
    let binary = folder.path().join("binary.urdf");
    // the mark of UTF-16 and half a letter
    std::fs::write(&binary, [0xff, 0xfe, 0x00]).unwrap();
    let got = UrdfChain::load(&binary, &ChainRequest::default())
        .unwrap_err()
        .to_string();
    assert!(got.contains("no element at all"), "{got}");
}

#[test]
fn numbers_at_the_end_of_their_range_end_in_an_error_and_not_in_nan() {
    let text = arm(
        "<link name=\"c\"><inertial><origin xyz=\"1e300 0 0\"/><mass value=\"1e300\"/>\
         <inertia ixx=\"1e300\" iyy=\"1\" izz=\"1\"/></inertial></link>\
         <joint name=\"j3\" type=\"fixed\"><parent link=\"b\"/><child link=\"c\"/><origin rpy=\"1 1e300 1\" xyz=\"1e308 1e308 1e308\"/></joint>",
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("r.urdf"), &text).unwrap();
    let robot = "[robot]\nmodel = \"serial\"\nurdf = \"r.urdf\"\n";
    if let Ok(file) = RobotFile::parse_in("r.toml", robot, Some(folder.path())) {
        let again = toml::to_string(&file).unwrap();
        assert_eq!(RobotFile::parse("r.toml", &again).unwrap(), file);
    }
}

/// Pieces that a broken URDF may be made of.
const PIECES: [&str; 18] = [
    "<robot name=\"r\">",
    "</robot>",
    "<link name=\"a\"/>",
    "<link name=\"b\">",
    "</link>",
    "<joint name=\"j\" type=\"revolute\">",
    "<joint name=\"k\" type=\"fixed\">",
    "</joint>",
    "<parent link=\"a\"/>",
    "<child link=\"b\"/>",
    "<mimic joint=\"j\"/>",
    "<inertial>",
    "</inertial>",
    "<mass value=\"1\"/>",
    "<inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/>",
    "<origin xyz=\"1 2 3\" rpy=\"nan 0 0\"/>",
    "<axis xyz=\"0 1 0\"/>",
    "<!--",
];

/// What stands where a word of a good file stood.
const WORDS: [&str; 26] = [
    "",
    " ",
    "0",
    "-0",
    "1",
    "-1",
    "1e-320",
    "1e308",
    "-1e308",
    "1e999",
    "nan",
    "inf",
    "0x1",
    "1 2",
    "1 2 3",
    "1 2 3 4",
    "stand",
    "world",
    "elbow",
    "hand",
    "base",
    "revolute",
    "prismatic",
    "fixed",
    "floating",
    "\u{1F980}\u{301}",
];

/// A good file with some of its words, lines and letters changed.
fn mutated(good: &str, draw: &mut ChaCha8Rng) -> String {
    let mut text = good.to_owned();
    for _ in 0..draw.random_range(1..5) {
        let edges: Vec<usize> = text
            .char_indices()
            .filter(|(_, c)| matches!(c, '"' | '<' | '>' | '=' | ' ' | '/'))
            .map(|(at, _)| at)
            .collect();
        if edges.len() < 4 {
            break;
        }
        let first = draw.random_range(0..edges.len() - 1);
        let word = edges[first] + 1..edges[first + 1];
        let lines: Vec<&str> = text.lines().collect();
        let mut line = || draw.random_range(0..lines.len());
        let (from, to) = (line(), line());
        match draw.random_range(0..10) {
            0..5 => text.replace_range(word, WORDS[draw.random_range(0..WORDS.len())]),
            5 => {
                // a line somewhere else, and where it was
                let mut out = lines.clone();
                out.insert(to, lines[from]);
                text = out.join("\n");
            }
            6 => {
                let mut out = lines.clone();
                out.remove(from);
                text = out.join("\n");
            }
            7 => {
                let mut out = lines.clone();
                out.swap(from, to);
                text = out.join("\n");
            }
            8 => {
                // as many levels as there are lines
                let many = "<link name=\"deep\">".repeat(draw.random_range(1..2000));
                text.insert_str(edges[first], &many);
            }
            _ => {
                let letter = char::from(draw.random_range(0..128_u8));
                text.insert(edges[first], letter);
            }
        }
    }
    text
}

/// Reads a mutated file as a URDF, as a robot, and back; whether it was a robot.
fn read(text: &str, folder: &Path) -> bool {
    let chain = match UrdfChain::parse("r.urdf", text, None) {
        Ok(chain) => chain,
        Err(error) => {
            let said = error.to_string();
            assert!(said.starts_with("r.urdf:"), "{said}");
            assert!(said.len() < 2000, "{said}");
            return false;
        }
    };
    assert!(!chain.links.is_empty());
    let _ = UrdfChain::parse("r.urdf", text, chain.links[0].name.as_deref());
    std::fs::write(folder.join("r.urdf"), text).unwrap();
    let robot = "[robot]\nmodel = \"serial\"\nurdf = \"r.urdf\"\n";
    let file = match RobotFile::parse_in("r.toml", robot, Some(folder)) {
        Ok(file) => file,
        Err(error) => {
            let said = error.to_string();
            assert!(said.starts_with("r.toml:") && said.contains("; "), "{said}");
            return false;
        }
    };
    let robot = file.robot();
    let (n, p) = (robot.joints(), robot.parameters().len());
    let mut y = vec![0.0; n * p];
    robot.regressor(&vec![0.1; n], &vec![0.2; n], &vec![0.3; n], &mut y);
    // without the URDF the file is the same robot
    let again = file.to_toml().unwrap();
    assert_eq!(RobotFile::parse("r.toml", &again).unwrap(), file);
    true
}

/// Mutations that are tried; `URDF_MUTATIONS` in the environment asks for more.
#[test]
fn no_mutation_of_a_good_file_panics_and_what_is_read_is_a_robot() {
    let asked = std::env::var("URDF_MUTATIONS").ok();
    let count: u64 = asked.and_then(|n| n.parse().ok()).unwrap_or(3000);
    let folder = tempfile::tempdir().unwrap();
    let seeds = [
        include_str!("../../../../fixtures/urdf/gantry.urdf").to_owned(),
        // joints that all turn about one line are no arm
        arm("").replace(
            "<parent link=\"a\"/>",
            "<origin xyz=\"0.3 0 0\"/><parent link=\"a\"/>",
        ),
    ];
    assert!(seeds.iter().all(|seed| read(seed, folder.path())));
    let mut robots = 0;
    for seed in 0..count {
        let mut draw = ChaCha8Rng::seed_from_u64(seed);
        let text = mutated(&seeds[usize::from(seed % 4 == 0)], &mut draw);
        let result = std::panic::catch_unwind(|| read(&text, folder.path()));
        match result {
            Ok(robot) => robots += u64::from(robot),
            Err(_) => panic!("mutation {seed}:\n{text}"),
        }
    }
    eprintln!("{robots} of {count} are robots");
    assert!(robots > count / 10 && robots < count, "{robots} of {count}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_arrangement_of_pieces_panics(order in prop::collection::vec(0..PIECES.len(), 0..40)) {
        let text: String = order.iter().map(|i| PIECES[*i]).collect();
        let _ = UrdfChain::parse("r.urdf", &text, None);
        let _ = UrdfChain::parse("r.urdf", &text, Some("b"));
    }

    #[test]
    fn no_single_damage_to_a_good_file_panics(at in 0usize..6000, byte in any::<u8>(), cut in any::<bool>()) {
        let good = include_str!("../../../../fixtures/urdf/gantry.urdf");
        let mut bytes = good.as_bytes().to_vec();
        let at = at % bytes.len();
        if cut { bytes.truncate(at) } else { bytes[at] = byte }
        if let Ok(text) = String::from_utf8(bytes) {
            let _ = UrdfChain::parse("r.urdf", &text, None);
        }
    }
}

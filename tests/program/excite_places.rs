//! `excite` keeps points above a floor and in a box, and links apart from each other.

use crate::excite_support;

use std::fs;

use predicates::str::{contains, starts_with};
use serde_json::Value;

use excite_support::excite;

/// Two links of 1 m and 0.5 m that turn about y on a post of 0.5 m; a positive angle lowers them.
const ARM: &str = "[robot]\nmodel = \"serial\"\n\
    [[robot.link]]\njoint = \"q1\"\nxyz = [0.0, 0.0, 0.5]\naxis = [0.0, 1.0, 0.0]\n\
    [[robot.link]]\njoint = \"q2\"\nxyz = [1.0, 0.0, 0.0]\naxis = [0.0, 1.0, 0.0]\n\
    [friction]\nfitted_with_inertias = true\n\
    [limits.q1]\nposition = [-1.5, 1.5]\nspeed = 1.5\nacceleration = 6.0\n\
    [limits.q2]\nposition = [-2.9, 2.9]\nspeed = 2.0\nacceleration = 8.0\n";
const FLOOR: &str = "[limits]\nfloor = 0.05\n[[limits.point]]\nname = \"tip\"\nlink = \"link_2\"\nxyz = [0.5, 0.0, 0.0]\n";
const CAPSULES: &str = "[[limits.capsule]]\nlink = \"base\"\nfrom = [0.0, 0.0, 0.0]\nto = [0.0, 0.0, 0.4]\nradius = 0.5\n\
    [[limits.capsule]]\nlink = \"link_1\"\nfrom = [0.1, 0.0, 0.0]\nto = [0.9, 0.0, 0.0]\nradius = 0.06\n\
    [[limits.capsule]]\nlink = \"link_2\"\nfrom = [0.1, 0.0, 0.0]\nto = [0.5, 0.0, 0.0]\nradius = 0.05\n";
/// q1 = 0.3 sin(w t), q2 at rest.
const NOD: &str = "kind = \"fourier\"\ncoordinates = \"joint\"\nfundamental_hz = 0.2\nperiods = 2\nblend_s = 5.0\n\
    [[coordinate]]\nname = \"q1\"\noffset = 0.0\na = [0.3769911184307752]\nb = [0.0]\n\
    [[coordinate]]\nname = \"q2\"\noffset = 0.0\na = [0.0]\nb = [0.0]\n";

fn limit<'a>(document: &'a Value, list: &str, name: &str) -> &'a Value {
    let all = document[list].as_array().unwrap();
    all.iter().find(|limit| limit["name"] == name).unwrap()
}

#[test]
fn a_point_that_comes_near_the_floor_breaks_its_limit_by_the_distance_of_trigonometry() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("nod.toml"), NOD).unwrap();
    // it comes down to 0.5 m - 1.5 m sin 0.3
    let lowest = 0.5 - 1.5 * 0.3_f64.sin();
    for (floor, status) in [("0.03", 0), ("0.05", 1)] {
        let text = format!("{ARM}{FLOOR}").replace("0.05", floor);
        fs::write(folder.path().join("arm.toml"), text).unwrap();
        let run = excite(folder.path(), "-r arm.toml --check nod.toml --json -")
            .assert()
            .code(status);
        let document: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
        let found = limit(&document, "limits", "tip");
        assert_eq!(
            (&found["quantity"], &found["unit"]),
            (&"height".into(), &"m".into())
        );
        let height = lowest - floor.parse::<f64>().unwrap();
        assert!(
            (found["least"].as_f64().unwrap() - height).abs() < 1e-6,
            "{found}"
        );
        assert!((found["used"].as_f64().unwrap() - 0.02 / height).abs() < 1e-4);
        assert_eq!(found["broken"], status == 1);
    }
    excite(folder.path(), "-r arm.toml --check nod.toml")
        .assert()
        .code(1)
        .stdout(starts_with("TORQUES ARE NOT FORESEEN: the masses of "))
        .stdout(contains(
            "NOT CHECKED: collisions of the robot with itself; what stands around",
        ))
        .stderr(contains("height of tip runs from 0.0067"))
        .stderr(contains("allowed is at least 0.020000; nearest at t = "));
}

#[test]
fn the_way_from_a_given_pose_is_held_against_every_limit() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{ARM}{}{CAPSULES}", FLOOR.replace("0.05", "0.0"));
    fs::write(folder.path().join("arm.toml"), text).unwrap();
    fs::write(folder.path().join("nod.toml"), NOD).unwrap();
    let check = "-r arm.toml --check nod.toml --rate 50 --samples m.csv";
    let near = format!("{check} --from -0.5,0.4");
    let shown = "NOT CHECKED: what stands around the robot, but for floor at tip.";
    excite(folder.path(), &near)
        .assert()
        .code(0)
        .stdout(contains(shown));
    let text = fs::read_to_string(folder.path().join("m.csv")).unwrap();
    assert!(text.contains("TORQUES ARE NOT FORESEEN"), "{text}");
    // from below the floor: the pose itself is the farthest
    let lowest = 0.5 - 1.0_f64.sin() - 0.5 * 0.8_f64.sin();
    let below = format!("{check} --from 1.0,-0.2 --json -");
    let run = excite(folder.path(), &below).assert().code(1);
    let document: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    let found = limit(&document, "way", "tip");
    assert!((found["least"].as_f64().unwrap() - lowest).abs() < 1e-9);
    assert_eq!(
        (found["t"].as_f64(), &found["broken"]),
        (Some(0.0), &true.into())
    );
    assert_eq!(limit(&document, "limits", "tip")["broken"], false);
    run.stderr(contains(
        "on the way from the given pose height of tip runs from",
    ))
    .stderr(contains("nearest at 0 % of it"));
    // folded onto the post, and short of a number
    excite(folder.path(), &format!("{check} --from 0.0,2.9"))
        .assert()
        .code(1)
        .stderr(contains("distance of base to link_2 runs from -"));
    excite(folder.path(), &format!("{check} --from 0.0"))
        .assert()
        .code(2)
        .stderr(contains("give one for each of q1, q2"));
}

#[test]
fn a_design_keeps_floor_and_links_apart_and_its_own_check_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{ARM}{FLOOR}{CAPSULES}");
    fs::write(folder.path().join("arm.toml"), &text).unwrap();
    let line = "-r arm.toml --harmonics 2 --frequency 0.2 --from -0.8,0.5 -o d.toml --json -";
    let run = excite(folder.path(), line).assert().code(0);
    let document: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    for list in ["limits", "way"] {
        for limit in document[list].as_array().unwrap() {
            assert!(limit["used"].as_f64().unwrap() <= 1.0, "{limit}");
        }
    }
    // without these limits the same search goes through the floor
    fs::write(folder.path().join("bare.toml"), ARM).unwrap();
    let bare = line
        .replace("arm.toml", "bare.toml")
        .replace("d.toml", "b.toml");
    excite(folder.path(), &bare).assert().code(0);
    excite(folder.path(), "-r arm.toml --check b.toml")
        .assert()
        .code(1)
        .stderr(contains("height of tip"));
    // no way leads out of the floor
    let below = line.replace("-0.8,0.5", "1.4,0.0");
    excite(folder.path(), &below)
        .assert()
        .code(3)
        .stderr(contains(
            "the pose of --from breaks a limit itself: the height of tip is -",
        ));
}

#[test]
fn links_of_the_cft_robot_are_placed_by_its_chain_and_a_single_joint_has_none() {
    let folder = tempfile::tempdir().unwrap();
    let floor = |height: &str| {
        format!(
            "[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\n[limits]\nfloor = {height}\n[[limits.point]]\nname = \"tool\"\nlink = \"link_7\"\n"
        )
    };
    let write = |text: &str| fs::write(folder.path().join("r.toml"), text).unwrap();
    write(&floor("-5.0"));
    excite(folder.path(), "-r r.toml --check configs/table3.toml")
        .assert()
        .code(0);
    write(&floor("5.0"));
    excite(folder.path(), "-r r.toml --check configs/table3.toml")
        .assert()
        .code(1)
        .stderr(contains("height of tool"));
    let cases = [
        (
            "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"prismatic\"\n[limits]\nfloor = 0.0\n",
            "r.toml:5: `limits` speaks of points or links",
        ),
        (
            &floor("0.0").replace("link_7", "link_9"),
            "did you mean `link_",
        ),
        (
            &format!("{ARM}[limits]\nfloor = 0.0\n"),
            "add [[limits.point]] tables",
        ),
        (
            &format!("{ARM}{FLOOR}{}", CAPSULES.replace("0.06", "-0.06")),
            "limits.capsule.1.radius",
        ),
        (&format!("{ARM}{FLOOR}colour = 1\n"), "unknown key `colour`"),
        (
            &ARM.replace("speed = 1.5", "speeed = 1.5"),
            "did you mean `speed`?",
        ),
    ];
    for (text, shown) in cases {
        write(text);
        excite(folder.path(), "-r r.toml -o d.toml")
            .assert()
            .code(3)
            .stderr(contains(shown));
    }
}

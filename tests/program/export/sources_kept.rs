//! What stays of the user's own files, and names that formats want apart.

use super::sources::{ARM, Bench, MJCF};

#[test]
fn the_base_of_an_mjcf_keeps_its_pose_where_the_first_body_has_none() {
    let bench = Bench::arm();
    let placed = MJCF
        .replace(
            "<body name=\"l1\" pos=\"0 0 0.3\">",
            "<body name=\"desk\" pos=\"0 0 1\"><body name=\"l1\" pos=\"0 0 -0.7\">",
        )
        .replace("</worldbody>", "</body></worldbody>");
    let out = bench.mjcf_from(&placed);
    assert!(out.contains("<body name=\"desk_fixed\">\n<body name=\"desk\" pos=\"0 0 1\">"));
    assert!(out.contains("body desk stands in one without a pose"));
    let told = placed.replace(
        "angle=\"degree\"",
        "angle=\"degree\" inertiafromgeom=\"false\"",
    );
    let out = bench.mjcf_from(&told);
    assert!(
        out.contains("<body name=\"desk_fixed\">\n<inertial"),
        "{out}"
    );
    // a base without a pose stays as it is
    let bare = bench.mjcf_from(MJCF);
    assert!(!bare.contains("_fixed"), "{bare}");
}

#[test]
fn angles_of_a_urdf_stay_as_they_are_written_and_what_they_cost_is_said() {
    let bench = Bench::of(
        &ARM.replace("1.5707963267948966", "1.5708")
            .replace("MORE", ""),
    );
    let export = bench.export("--urdf out.urdf --urdf-source arm.urdf");
    export.success();
    let out = std::fs::read_to_string(bench.folder.path().join("out.urdf")).unwrap();
    assert!(out.contains("rpy=\"0 1.5708 0\""), "{out}");
    assert!(
        out.contains("frames of the source, which are rounded"),
        "{out}"
    );
}

#[test]
fn no_two_parts_of_an_sdf_have_one_name() {
    let twice = ARM.replace("\"l3\"", "\"j3\"").replace("MORE", "");
    let bench = Bench::of(&twice);
    bench.export("--sdf out.sdf").success();
    let out = std::fs::read_to_string(bench.folder.path().join("out.sdf")).unwrap();
    assert!(out.contains("<link name=\"j3_link\">"), "{out}");
    assert!(out.contains("<child>j3_link</child>") && out.contains("<joint name=\"j3\""));
}

#[test]
fn joints_of_a_usd_whose_names_it_cannot_hold_keep_them_for_display() {
    let bench = Bench::of(&ARM.replace("\"j3\"", "\"j.3\"").replace("MORE", ""));
    bench.export("--usd out.usda").success();
    let out = std::fs::read_to_string(bench.folder.path().join("out.usda")).unwrap();
    assert!(out.contains("PhysicsRevoluteJoint \"j_3\" ("), "{out}");
    assert_eq!(out.matches("displayName = \"j.3\"").count(), 1, "{out}");
    assert_eq!(out.matches("displayName").count(), 2, "{out}");
}

#[test]
fn frames_of_an_mjcf_without_mass_have_what_every_reader_takes() {
    const FRAMES: &str = r#"<body name="plate"><inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/></body><body name="l1""#;
    const TOOL: &str = r#"<joint name="j3" class="wrist"/><body name="tool" pos="0.3 0 0"/>"#;
    let bench = Bench::arm();
    let source = MJCF
        .replace("<body name=\"l1\"", FRAMES)
        .replace("<joint name=\"j3\" class=\"wrist\"/>", TOOL);
    let out = bench.mjcf_from(&source);
    assert!(!out.contains("mass=\"0\""), "{out}");
    assert!(
        out.contains("<body name=\"tool\" pos=\"0.3 0 0\"/>"),
        "{out}"
    );
    // where geoms have no part in it, a body without an inertial is refused by some
    let told = source.replace(
        "angle=\"degree\"",
        "angle=\"degree\" inertiafromgeom=\"false\"",
    );
    let out = bench.mjcf_from(&told);
    assert_eq!(out.matches("mass=\"1e-9\"").count(), 2, "{out}");
    assert!(
        out.contains("<body name=\"tool\" pos=\"0.3 0 0\">\n<inertial"),
        "{out}"
    );
}

#[test]
fn a_urdf_with_more_joints_than_a_model_can_have_takes_one() {
    use std::fmt::Write;
    let mut fingers = String::new();
    for k in 0..40 {
        let _ = write!(
            fingers,
            "<link name=\"f{k}\"/><joint name=\"f{k}_joint\" type=\"revolute\"><parent link=\"l3\"/><child link=\"f{k}\"/>\
             <axis xyz=\"0 1 0\"/></joint>"
        );
    }
    let bench = Bench::arm();
    let source = ARM.replace("MORE", &fingers);
    std::fs::write(bench.folder.path().join("source.urdf"), source).unwrap();
    let export = bench.export("--urdf out.urdf --urdf-source source.urdf");
    export.success();
}

#[test]
fn poses_of_an_mjcf_that_mujoco_alone_reads_are_written_for_all() {
    const JOINT: &str = r#"<joint name="j3" class="wrist"/>"#;
    let bench = Bench::arm();
    let framed = MJCF
        .replace(
            "<body name=\"l3\" pos=\"0.4 0 0\">",
            "<frame pos=\"0.4 0 0.4\" euler=\"0 90 0\" childclass=\"wrist\"><frame pos=\"0.4 0 0\" euler=\"0 -90 0\"><body name=\"l3\">",
        )
        .replace(JOINT, "<frame euler=\"90 0 0\"><joint name=\"j3\" axis=\"0 0 -1\"/></frame>")
        .replace("0.3 0 0\"/>\n        </body>", "0.3 0 0\"/>\n        </body></frame></frame>");
    let turned = MJCF
        .replace("angle=\"degree\"", "angle=\"degree\" eulerseq=\"XYZ\"")
        .replace(
            JOINT,
            "<joint name=\"j3\" class=\"wrist\"/><body name=\"tip\" axisangle=\"0 0 2 90\"/>",
        );
    let out = bench.mjcf_from(&framed);
    assert!(!out.contains("<frame") && !out.contains("</frame"), "{out}");
    assert!(out.contains("childclass=\"wrist\""), "{out}");
    let out = bench.mjcf_from(&turned);
    let body = out.split("-->").nth(1).unwrap();
    assert!(
        !body.contains("euler=") && !body.contains("axisangle"),
        "{out}"
    );
    // what else a frame holds stays in it, and the head says who reads it
    let held = framed.replace("<body name=\"l3\">", "<site name=\"s\"/><body name=\"l3\">");
    let out = bench.mjcf_from(&held);
    assert!(
        out.contains("<frame") && out.contains("MuJoCo alone reads it"),
        "{out}"
    );
}

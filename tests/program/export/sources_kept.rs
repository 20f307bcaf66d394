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

//! Models written into the user's own URDF and MJCF: the file gives the torques of the model, or it is refused by what
//! differs. The program reads back what it writes, so that success means the same torques.

use super::*;
use predicates::str::contains;

pub(super) const ARM: &str = "<robot name=\"arm\"><link name=\"base\"/><link name=\"l1\"/><link name=\"l2\"/><link name=\"l3\"/>\
    <joint name=\"j1\" type=\"revolute\"><parent link=\"base\"/><child link=\"l1\"/><origin xyz=\"0 0 0.3\"/><axis xyz=\"0 0 1\"/></joint>\
    <joint name=\"j2\" type=\"revolute\"><parent link=\"l1\"/><child link=\"l2\"/><origin xyz=\"0 0.2 0\" rpy=\"0 1.5707963267948966 0\"/><axis xyz=\"0 1 0\"/></joint>\
    <joint name=\"j3\" type=\"revolute\"><parent link=\"l2\"/><child link=\"l3\"/><origin xyz=\"0.4 0 0\"/><axis xyz=\"0 1 0\"/></joint>MORE</robot>";

/// Two bodies on joints that the model lacks, of 0.04 and 0.02 kg, and a frame that is fixed to the second.
const BRANCHES: &str = "<link name=\"camera\"><inertial><origin xyz=\"0 0.04 0.05\"/><mass value=\"0.04\"/><inertia ixx=\"0.0005\" iyy=\"0.0006\" izz=\"0.0007\"/></inertial></link>\
    <joint name=\"pan\" type=\"revolute\"><parent link=\"l1\"/><child link=\"camera\"/><origin xyz=\"0 0.1 0.1\" rpy=\"0.2 0 0.4\"/><axis xyz=\"0 0 1\"/></joint>\
    <link name=\"lens\"><inertial><mass value=\"0.02\"/><inertia ixx=\"0.0001\" iyy=\"0.0001\" izz=\"0.0001\"/></inertial></link>\
    <joint name=\"zoom\" type=\"prismatic\"><parent link=\"camera\"/><child link=\"lens\"/><origin xyz=\"0 0 0.02\"/><axis xyz=\"0 0 1\"/></joint>\
    <link name=\"glass\"><inertial><mass value=\"0.01\"/><inertia ixx=\"0.0001\" iyy=\"0.0001\" izz=\"0.0001\"/></inertial></link>\
    <joint name=\"glued\" type=\"fixed\"><parent link=\"lens\"/><child link=\"glass\"/></joint>";

pub(super) const MJCF: &str = r#"<mujoco model="arm3"><compiler angle="degree"/>
  <default>
    <joint armature="0.1" damping="1" frictionloss="0.2"/>
    <default class="wrist"><joint armature="0.05" axis="0 1 0"/></default>
  </default>
  <worldbody>
    <body name="l1" pos="0 0 0.3">
      <inertial pos="0 0 0" mass="3" diaginertia="0.05 0.05 0.05"/>
      <joint name="j1" type="hinge" axis="0 0 1" range="-170 170"/>
      <geom type="capsule" size="0.05" fromto="0 0 0 0 0.2 0"/>
      <body name="l2" pos="0 0.2 0" euler="0 90 0">
        <inertial pos="0.2 0 0" mass="2" diaginertia="0.01 0.04 0.04"/>
        <joint name="j2" type="hinge" axis="0 1 0" range="-120 60"/>
        <body name="l3" pos="0.4 0 0">
          <inertial pos="0.1 0 0" mass="1" diaginertia="0.002 0.01 0.01"/>
          <joint name="j3" class="wrist"/>
          <geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="m3" joint="j3"/></actuator>
</mujoco>
"#;

/// A folder with a model of the arm.
pub(super) struct Bench {
    pub(super) folder: tempfile::TempDir,
}

impl Bench {
    pub(super) fn of(urdf: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("arm.urdf"), urdf).unwrap();
        let robot = "[robot]\nmodel = \"serial\"\nurdf = \"arm.urdf\"\n";
        let robot = RobotFile::parse_in("arm.toml", robot, Some(folder.path())).unwrap();
        let model = feasible(robot).to_toml().unwrap();
        std::fs::write(folder.path().join("model.toml"), model).unwrap();
        Self { folder }
    }

    pub(super) fn arm() -> Self {
        Self::of(&ARM.replace("MORE", ""))
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.folder.path().join(name), text).unwrap();
    }

    pub(super) fn export(&self, line: &str) -> assert_cmd::assert::Assert {
        let mut command = assert_cmd::Command::cargo_bin("cft-ident").unwrap();
        command
            .current_dir(self.folder.path())
            .args(["export", "-m", "model.toml"]);
        command.args(line.split_whitespace()).assert()
    }

    /// The MJCF with the model in it.
    pub(super) fn mjcf_from(&self, source: &str) -> String {
        self.write("source.xml", source);
        self.export("--mjcf out.xml --mjcf-source source.xml")
            .success();
        self.text("out.xml")
    }

    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.folder.path().join(name)).unwrap()
    }
}

/// The text without the comment at its head.
fn body(text: &str) -> &str {
    text.split_once("-->\n<").map_or(text, |(_, body)| body)
}

#[test]
fn what_changes_bodies_while_an_mjcf_is_compiled_is_taken_out_and_named() {
    let bench = Bench::arm();
    for (old, new, gone) in [
        (
            "angle=\"degree\"",
            "angle=\"degree\" inertiafromgeom=\"true\"",
            "inertiafromgeom",
        ),
        (
            "angle=\"degree\"",
            "angle=\"degree\" settotalmass='20'",
            "settotalmass",
        ),
        (
            "angle=\"degree\"",
            "boundmass=\"2.5\" angle=\"degree\"",
            "boundmass",
        ),
        (
            "angle=\"degree\"",
            "angle=\"degree\" boundinertia=\"0.05\"",
            "boundinertia",
        ),
        (
            "angle=\"degree\"",
            "angle=\"degree\" balanceinertia=\"true\"",
            "balanceinertia",
        ),
        (
            "<default>",
            "<option><flag gravity=\"disable\" contact=\"disable\"/></option><default>",
            "flag gravity",
        ),
        (
            "joint=\"j3\"/>",
            "joint=\"j3\" gear=\"5\" armature=\"0.002\"/>",
            "armature=\"0.002\"",
        ),
        (
            "<default>\n",
            "<default><motor damping=\"0.5\"/>\n",
            "damping=\"0.5\" of actuator m3",
        ),
        (
            "class=\"wrist\"/>",
            "class=\"wrist\" springdamper=\"1 2\"/>",
            "springdamper",
        ),
    ] {
        let source = MJCF.replacen(old, new, 1);
        assert_ne!(source, MJCF);
        let text = bench.mjcf_from(&source);
        let head = text.split("-->").next().unwrap();
        assert!(head.contains(gone), "{gone}: {head}");
    }
    let kept = bench.mjcf_from(&MJCF.replace("<compiler ", "<compiler inertiafromgeom=\"false\" "));
    assert!(kept.contains("inertiafromgeom=\"false\""));
    // what is no body of the robot stays as it was
    assert!(kept.contains("<geom type=\"capsule\" size=\"0.05\" fromto=\"0 0 0 0 0.2 0\"/>"));
}

#[test]
fn what_is_welded_to_a_link_weighs_nothing() {
    let bench = Bench::arm();
    let tool = "<body name=\"tool\" pos=\"0.3 0 0\"><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>\
                <geom size=\"0.1\"/><frame pos=\"0 0 1\"><geom size=\"0.2\" mass=\"3\"/></frame></body>\n        </body>";
    let text = bench.mjcf_from(&MJCF.replacen("</body>", tool, 1));
    let tool = text.split("name=\"tool\"").nth(1).unwrap();
    let tool = tool.split("</body>").next().unwrap();
    assert!(!tool.contains("<inertial"), "{tool}");
    assert_eq!(tool.matches("mass=\"0\"").count(), 2, "{tool}");
}

#[test]
fn torques_that_the_source_adds_stay_and_are_lines_of_the_table() {
    let bench = Bench::arm();
    for (old, new, what) in [
        (
            "<joint name=\"j3\"",
            "<joint name=\"j3\" stiffness=\"3\" springref=\"10\"",
            "the spring of j3",
        ),
        (
            "<body name=\"l2\"",
            "<body gravcomp=\"1\" name=\"l2\"",
            "gravcomp",
        ),
        (
            "<default>",
            "<option density=\"1.2\" viscosity=\"1e-5\"/><default>",
            "a fluid",
        ),
        (
            "<actuator>",
            "<tendon><fixed name=\"belt\" stiffness=\"2\"><joint joint=\"j2\" coef=\"1\"/></fixed></tendon><actuator>",
            "the tendon belt",
        ),
    ] {
        let text = bench.mjcf_from(&MJCF.replacen(old, new, 1));
        assert!(text.contains(&format!("the source adds {what}")), "{what}");
        assert!(bench.text("out.xml.left-out.toml").contains(what), "{what}");
        assert!(
            body(&text).contains(new.split("><").next().unwrap()),
            "{what}"
        );
    }
}

#[test]
fn an_mjcf_of_another_robot_is_refused_by_what_differs() {
    let bench = Bench::arm();
    for (old, new, words) in [
        (
            "class=\"wrist\"/>",
            "class=\"wrist\" axis=\"0 -1 0\"/>",
            "its axis is",
        ),
        (
            "<joint armature=\"0.05\" axis=\"0 1 0\"/>",
            "<joint armature=\"0.05\"/>",
            "its axis is",
        ),
        ("euler=\"0 90 0\"", "euler=\"0 80 0\"", "turned otherwise"),
        ("angle=\"degree\"", "angle=\"radian\"", "turned otherwise"),
        (
            "axis=\"0 1 0\" range=\"-120 60\"",
            "axis=\"0 1 0\" ref=\"30\"",
            "joint `j2` has the ref",
        ),
        (
            "class=\"wrist\"/>",
            "class=\"wrist\" pos=\"0.1 0 0\"/>",
            "its axis goes through",
        ),
        (
            "class=\"wrist\"/>",
            "class=\"wrist\" type=\"slide\"/>",
            "the one joint slides",
        ),
        (
            "class=\"wrist\"/>",
            "class=\"wrist\" type=\"ball\"/>",
            "of the type ball",
        ),
        (
            "<body name=\"l3\" pos=\"0.4 0 0\">",
            "<body name=\"l3\">",
            "its origin is",
        ),
        (
            "<body name=\"l1\"",
            "<frame euler=\"10 0 0\"/><body euler=\"10 0 0\" name=\"l1\"",
            "turned otherwise",
        ),
        (
            "name=\"j3\"",
            "name=\"knee\"",
            "has no joint `j3`; it has j1, j2, knee",
        ),
        (
            "<joint name=\"j3\" class=\"wrist\"/>",
            "<joint name=\"j3\" class=\"wrist\"/><attach model=\"m\"/>",
            "<attach> of line 16",
        ),
    ] {
        let source = MJCF.replacen(old, new, 1);
        assert_ne!(source, MJCF, "{old}");
        bench.write("other.xml", &source);
        bench
            .export("--mjcf out.xml --mjcf-source other.xml")
            .code(3)
            .stderr(contains(words));
    }
}

#[test]
fn frames_static_bodies_includes_and_every_notation_of_an_orientation_are_read() {
    let bench = Bench::arm();
    for (old, new) in [
        ("euler=\"0 90 0\"", "quat=\"2 0 2 0\""),
        ("euler=\"0 90 0\"", "axisangle=\"0 3 0 90\""),
        ("euler=\"0 90 0\"", "xyaxes=\"0 0 -2 0 1 0.5\""),
        ("euler=\"0 90 0\"", "zaxis=\"5 0 0\""),
        (
            "angle=\"degree\"/>",
            "angle=\"degree\"/><compiler eulerseq=\"ZYX\"/>",
        ),
        (
            "<body name=\"l2\" pos=\"0 0.2 0\" euler=\"0 90 0\">",
            "<body name=\"l2\" pos=\"0 0.2 0\" euler=\"-90 90 90\">",
        ),
        (
            "<body name=\"l1\" pos=\"0 0 0.3\">",
            "<body name=\"stand\" pos=\"1 2 3\" euler=\"0 0 0\"/><body name=\"l1\">",
        ),
    ] {
        let source = MJCF.replacen(old, new, 1);
        assert_ne!(source, MJCF, "{old}");
        bench.mjcf_from(&source);
    }
    // l3 in two frames and a body without a joint
    let framed = MJCF
        .replacen("<body name=\"l3\" pos=\"0.4 0 0\">", "<frame euler=\"0 0 90\"><frame pos=\"0 -0.1 0\" childclass=\"wrist\">\
                  <body name=\"elbow\" euler=\"0 0 -90\"><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>\
                  <body name=\"l3\" pos=\"0.3 0 0\">", 1)
        .replacen(" class=\"wrist\"/>", "/>", 1)
        .replacen("</body>", "</body></body></frame></frame>", 1);
    bench.mjcf_from(&framed);
    // bodies in a file of their own, below
    let (before, rest) = MJCF.split_once("<worldbody>").unwrap();
    let (bodies, after) = rest.split_once("</worldbody>").unwrap();
    std::fs::create_dir(bench.folder.path().join("parts")).unwrap();
    bench.write(
        "parts/body.xml",
        &format!("<mujocoinclude><worldbody>{bodies}</worldbody></mujocoinclude>"),
    );
    let text = bench.mjcf_from(&format!(
        "{before}<include file=\"parts/body.xml\"/>{after}"
    ));
    assert!(!text.contains("<include") && text.contains("fromto"));
}

#[test]
fn meshes_are_found_from_the_folder_of_the_output() {
    let bench = Bench::arm();
    std::fs::create_dir(bench.folder.path().join("to")).unwrap();
    std::fs::create_dir(bench.folder.path().join("from")).unwrap();
    bench.write(
        "from/a.xml",
        &MJCF.replace("<compiler ", "<compiler meshdir=\"assets\" "),
    );
    bench.write(
        "from/b.xml",
        &MJCF.replace("<compiler angle=\"degree\"/>", "<asset/>"),
    );
    let mesh = "<link name=\"l1\"><visual><geometry><mesh filename=\"m/a.stl\"/></geometry></visual><visual><geometry><mesh filename=\"package://a.stl\"/></geometry></visual></link>";
    bench.write(
        "from/c.urdf",
        &ARM.replace("MORE", "").replace("<link name=\"l1\"/>", mesh),
    );
    bench
        .export("--mjcf to/a.xml --mjcf-source from/a.xml")
        .success();
    bench
        .export("--mjcf to/b.xml --mjcf-source from/b.xml")
        .success();
    bench
        .export("--urdf to/c.urdf --urdf-source from/c.urdf")
        .success();
    assert!(
        bench
            .text("to/a.xml")
            .contains("meshdir=\"../from/assets\"")
    );
    assert!(bench.text("to/a.xml").contains("texturedir=\"../from\""));
    assert!(
        bench
            .text("to/b.xml")
            .contains("<compiler meshdir=\"../from\" texturedir=\"../from\"/>")
    );
    let urdf = bench.text("to/c.urdf");
    assert!(
        urdf.contains("\"../from/m/a.stl\"") && urdf.contains("\"package://a.stl\""),
        "{urdf}"
    );
    bench
        .export("--mjcf from/d.xml --mjcf-source from/a.xml")
        .success();
    assert!(bench.text("from/d.xml").contains("meshdir=\"assets\""));
}

#[test]
fn branches_that_were_held_are_taken_off_the_link_that_carries_them_or_weigh_next_to_nothing() {
    for (mass, keeps) in [("0.04", true), ("40", false)] {
        let bench = Bench::arm();
        let source = ARM
            .replace("MORE", BRANCHES)
            .replace("mass value=\"0.04\"", &format!("mass value=\"{mass}\""));
        bench.write("whole.urdf", &source);
        bench
            .export("--urdf full.urdf --urdf-source whole.urdf")
            .success();
        let text = bench.text("full.urdf");
        assert_eq!(text.contains("<mass value=\"1e-9\"/>"), !keeps, "{text}");
        assert_eq!(
            text.contains(&format!("<mass value=\"{mass}\"/>")),
            keeps,
            "{text}"
        );
        let head = text.split("-->").next().unwrap();
        assert!(
            head.contains("The mass of camera, lens is in the identified one of l1"),
            "{head}"
        );
        // the file beside it ends the chain at l3, and is the model
        let back = ModelFile::load(&bench.folder.path().join("full.toml")).unwrap();
        let file = ModelFile::load(&bench.folder.path().join("model.toml")).unwrap();
        let [one, other] = [file, back].map(|file| file.model("a.toml").unwrap());
        let worst = urdf::difference(&one, &other);
        assert!(worst < 1e-6, "{worst:e}");
        let hung = format!(
            "<body name=\"camera\" pos=\"0 0.1 0.1\" euler=\"0 10 0\"><inertial pos=\"0 0.04 0.05\" mass=\"{mass}\" diaginertia=\"0.005 0.006 0.007\"/>\
                    <joint name=\"pan\" ref=\"20\"/><body name=\"lens\"><geom size=\"0.01\" mass=\"0\"/></body></body><body name=\"l2\""
        );
        let text = bench.mjcf_from(&MJCF.replacen("<body name=\"l2\"", &hung, 1));
        assert_eq!(text.contains("mass=\"1e-9\""), !keeps, "{text}");
    }
}

#[test]
fn a_branch_whose_weight_only_its_geoms_say_weighs_next_to_nothing() {
    let bench = Bench::arm();
    let hung =
        "<body name=\"camera\"><joint name=\"pan\"/><geom size=\"0.05\"/></body><body name=\"l2\"";
    let text = bench.mjcf_from(&MJCF.replacen("<body name=\"l2\"", hung, 1));
    assert!(text.contains("mass=\"1e-9\""), "{text}");
}

const FINGERS: &str = "<link name=\"left\"/><joint name=\"left_joint\" type=\"revolute\"><parent link=\"l3\"/><child link=\"left\"/><origin xyz=\"0.18 0.04 0\"/><axis xyz=\"0 0 1\"/></joint>\
    <link name=\"right\"/><joint name=\"right_joint\" type=\"revolute\"><parent link=\"l3\"/><child link=\"right\"/><origin xyz=\"0.18 -0.04 0\"/><axis xyz=\"0 0 -1\"/><dynamics damping=\"7\"/><mimic joint=\"left_joint\" multiplier=\"-2\" offset=\"0.1\"/></joint>";

#[test]
fn followers_get_their_inertials_and_no_friction_beside_that_of_the_joint_that_they_follow() {
    let urdf = ARM.replace("MORE", FINGERS);
    let bench = Bench::of(&urdf);
    bench
        .export("--urdf full.urdf --urdf-source arm.urdf")
        .success();
    assert!(!bench.text("full.urdf").contains("damping=\"7\""));
    let finger = |name: &str, joint: &str, y: &str, axis: &str| {
        format!(
            "<body name=\"{name}\" pos=\"0.18 {y} 0\"><inertial pos=\"0 0 0\" mass=\"9\" diaginertia=\"1 1 1\"/>\
             <joint name=\"{joint}\" axis=\"{axis}\" damping=\"7\"/></body>"
        )
    };
    for name in ["right", "other_name"] {
        let both = finger("left", "left_joint", "0.04", "0 0 1")
            + &finger(name, "right_joint", "-0.04", "0 0 -1");
        let source = MJCF.replacen("</body>", &format!("{both}</body>"), 1);
        let tie = "<equality><joint joint1=\"right_joint\" joint2=\"left_joint\" polycoef=\"0.1 -2 0 0 0\"/></equality></mujoco>";
        let text = bench.mjcf_from(&source.replace("</mujoco>", tie));
        assert!(
            !text.contains("mass=\"9\"") && !text.contains("damping=\"7\""),
            "{text}"
        );
        // the equality of the source, and no second one
        assert_eq!(text.matches("joint1=").count(), 1);
        if name == "right" {
            bench.write(
                "source.xml",
                &source.replace("</mujoco>", &tie.replace("-2", "-1")),
            );
            let other = bench
                .export("--mjcf out.xml --mjcf-source source.xml")
                .failure();
            other.stderr(contains("follows `left_joint` by 0.1 -1.0"));
        }
    }
    // one that is not there is named, with what it carries
    let one = finger("left", "left_joint", "0.04", "0 0 1");
    let text = bench.mjcf_from(&MJCF.replacen("</body>", &format!("{one}</body>"), 1));
    assert!(
        text.contains("link right of the model is not in this file"),
        "{text}"
    );
    assert!(text.contains("links that the source lacks"), "{text}");
    bench.export("--urdf plain.urdf --mjcf plain.xml").success();
    assert_eq!(bench.text("plain.xml").matches("joint1=").count(), 1);
    assert!(!bench.text("plain.urdf").contains("equality"));
}

#[test]
fn a_tip_keeps_what_is_fixed_to_it_and_what_hangs_on_its_chain() {
    let folder = tempfile::tempdir().unwrap();
    let inertial = "<inertial><mass value=\"1.5\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\"/></inertial>";
    let hand = format!(
        "<link name=\"hand\">{inertial}</link><joint name=\"hand_fixed\" type=\"fixed\"><parent link=\"l3\"/><child link=\"hand\"/><origin xyz=\"0.2 0 0\"/></joint>"
    );
    let neck = "<link name=\"head\"/><joint name=\"neck\" type=\"revolute\"><parent link=\"base\"/><child link=\"head\"/><axis xyz=\"0 0 1\"/></joint>";
    let text = ARM.replace("MORE", &format!("{hand}{neck}{BRANCHES}"));
    std::fs::write(folder.path().join("arm.urdf"), text).unwrap();
    let robot = "[robot]\nmodel = \"serial\"\nurdf = \"arm.urdf\"\ntip = \"l3\"\n";
    let robot = RobotFile::parse_in("arm.toml", robot, Some(folder.path())).unwrap();
    let mass = |k: usize| robot.robot.link[k].inertial.as_ref().map(|body| body.mass);
    assert_eq!(robot.robot.link.len(), 3);
    assert_eq!(mass(2), Some(1.5));
    assert!((mass(0).unwrap() - 0.07).abs() < 1e-12, "{:?}", mass(0));
    // a frame of the chain, and none of what hangs on it
    let frames: Vec<&str> = robot
        .robot
        .frame
        .iter()
        .map(|frame| frame.name.as_str())
        .collect();
    assert_eq!(frames, ["hand"]);
}

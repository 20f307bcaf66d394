//! Tests of one arm that stand in one file, and joints that one drive moves.

use std::f64::consts::TAU;
use std::fmt::Write;

use crate::log_folder::run_line;

/// Numbers of [-0.5, 0.5].
struct Chance(u64);

impl Chance {
    fn draw_number(&mut self) -> f64 {
        self.0 = (self.0)
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1u32 << 31) - 0.5
    }
}

/// Volts by the time of a test [s].
type Volts<'a> = &'a dyn Fn(f64) -> f64;

/// Weight of the arm of the four tests \[V\].
const WEIGHT: f64 = 0.62;

/// Four tests of an arm, as tools for motors of robots in competitions record them: two slow ramps of the voltage and two
/// steps, 6 s between them, from one stop to the other. V = 0.21 sgn(w) + 0.62 cos(q) + 1.85 w + 0.11 a, at 50 Hz.
fn four_tests() -> String {
    let tests: [(&str, Volts, f64); 4] = [
        ("quasistatic-forward", &|t| 0.25 * t, -1.1),
        ("quasistatic-reverse", &|t| -0.25 * t, 1.3),
        ("dynamic-forward", &|_| 3.0, -1.1),
        ("dynamic-reverse", &|_| -3.0, 1.3),
    ];
    let mut text = "Timestamp (s),State,Voltage (V),Position (rot),Velocity (rot/s)\n".to_owned();
    let (mut chance, mut begins) = (Chance(7), 100.0);
    for (name, volts, from) in tests {
        let (mut q, mut w, mut step) = (from, 0.0_f64, 0_u32);
        // a row every twenty steps of a millisecond
        while (-1.11..1.35).contains(&q) {
            let t = 0.001 * f64::from(step);
            let asked = volts(t);
            let driving = asked - WEIGHT * q.cos() - 1.85 * w;
            if step.is_multiple_of(20) {
                let turns = (q / TAU * 4096.0).round() / 4096.0;
                let (at, noisy, speed) = (begins + t, asked + 0.02 * chance.draw_number(), w / TAU);
                writeln!(text, "{at:.3},{name},{noisy:.4},{turns:.6},{speed:.5}").unwrap();
            }
            // it rests on its stop, or where it stuck, until the drive lifts it
            let direction = if w == 0.0 {
                driving.signum()
            } else {
                w.signum()
            };
            let lifted = -from.signum() * driving > 0.21;
            if w != 0.0 || lifted {
                let next = w + 0.001 * (driving - 0.21 * direction) / 0.11;
                w = if next * w < 0.0 { 0.0 } else { next };
                q += 0.001 * w;
            }
            step += 1;
        }
        begins += 0.001 * f64::from(step) + 6.0;
    }
    text
}

#[test]
fn tests_of_several_kinds_in_one_file_are_found_and_none_is_set_aside_whole() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("tests.csv"), four_tests()).unwrap();
    let (code, seen, said) = run_line(folder.path(), "inspect tests.csv");
    assert_eq!(code, 0, "{said}");
    assert_eq!(seen["gaps"], serde_json::json!([]));
    let parted = seen["warnings"].to_string();
    assert!(
        parted.contains("4 runs of") && parted.contains("`State`"),
        "{parted}"
    );
    let (code, _, said) = run_line(folder.path(), "new arm --log tests.csv");
    assert_eq!(code, 0, "{said}");
    let (code, _, said) = run_line(folder.path(), "identify tests.csv arm.toml -o run");
    assert_eq!(code, 0, "{said}");
    let model = std::fs::read_to_string(folder.path().join("run/refined.toml")).unwrap();
    // the weight of the arm, and nothing that goes by time in its place
    assert!(
        !model.contains("\"drift\"") && !model.contains("\"settling-drift\""),
        "{model}"
    );
    let weight = model.split("[effect.parameters.cos]\nvalue = ").nth(1);
    let weight = weight.and_then(|rest| rest.lines().next()?.parse::<f64>().ok());
    let weight = weight.unwrap_or_else(|| panic!("{said}\n{model}"));
    assert!((weight - WEIGHT).abs() < 0.03, "{weight}");
}

/// A slide that carries two links in a vertical plane; what is said of the last joint beside its axis.
fn two_links(said: &str) -> String {
    let link = |name: &str, at: f64| {
        format!(
            "<link name='{name}'><inertial><origin xyz='{at} 0 0'/><mass value='1'/><inertia ixx='0.001' ixy='0' ixz='0' iyy='0.001' iyz='0' izz='0.001'/></inertial></link>\n"
        )
    };
    let joint = |[name, kind, parent, child]: [&str; 4], at: f64, said: &str| {
        format!(
            "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/><origin xyz='{at} 0 0'/><axis xyz='0 -1 0'/><limit lower='-3' upper='3' effort='50' velocity='9'/>{said}</joint>\n"
        )
    };
    [
        "<robot name='two'><link name='base'/>\n".to_owned(),
        joint(["c", "prismatic", "base", "cart"], 0.0, ""),
        link("cart", 0.0),
        joint(["a", "revolute", "cart", "upper"], 0.0, ""),
        link("upper", 0.2),
        joint(["b", "revolute", "upper", "fore"], 0.5, said),
        link("fore", 0.3),
        "</robot>\n".to_owned(),
    ]
    .concat()
}

/// A log of a slide across the plane of two links, of which one drive moves the second as far against the first as that
/// against the slide: point masses of 2 kg at 0.2 m and 1.5 kg at 0.3 m, and friction.
fn moved_by_one_drive() -> String {
    let (m1, r1, m2, r2, l, g) = (2.0, 0.2, 1.5, 0.3, 0.5, 9.81);
    let mut chance = Chance(11);
    let mut text = "t,q_c,q_a,q_b,tau_c,tau_a,tau_b\n".to_owned();
    for k in 0..2500 {
        let t = 0.01 * f64::from(k);
        let sum = |of: &dyn Fn(f64, f64) -> f64| of(0.7, 1.9) + of(0.25, 4.7);
        let q = sum(&|a, w| a * (w * t).sin());
        let v = sum(&|a, w| a * w * (w * t).cos());
        let a = -sum(&|a, w| a * w * w * (w * t).sin());
        let mass = m1 * r1 * r1 + m2 * (l * l + 4.0 * r2 * r2 + 4.0 * l * r2 * q.cos());
        let speed = -2.0 * m2 * l * r2 * q.sin() * v * v;
        let weight = g * (m1 * r1 * q.cos() + m2 * (l * q.cos() + 2.0 * r2 * (2.0 * q).cos()));
        let friction = 0.3 * v + 0.5 * (100.0 * v).tanh();
        let tau = mass * a + speed + weight + friction + 0.05 * chance.draw_number();
        // the slide moves what hangs on it across the plane: neither feels the other
        let [slow, fast] = [1.3 * t, 5.3 * t];
        let slide = 0.4 * slow.sin() + 0.05 * fast.sin();
        let rate = 0.52 * slow.cos() + 0.265 * fast.cos();
        let force = -(m1 + m2) * (0.676 * slow.sin() + 1.4045 * fast.sin())
            + 2.0 * rate
            + 3.0 * (100.0 * rate).tanh()
            + 0.05 * chance.draw_number();
        let unread = 0.3 * chance.draw_number();
        writeln!(
            text,
            "{t:.2},{slide:.6},{q:.6},{q:.6},{force:.4},{tau:.4},{unread:.4}"
        )
        .unwrap();
    }
    text
}

#[test]
fn joints_that_one_drive_moves_get_the_line_of_the_urdf_that_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("two.urdf", &two_links(""));
    write("log.csv", &moved_by_one_drive());
    let (code, _, said) = run_line(folder.path(), "new two --urdf two.urdf --log log.csv");
    assert_eq!(code, 0, "{said}");
    let (code, _, said) = run_line(folder.path(), "lsq log.csv -r two.toml -o m.toml");
    assert_eq!(code, 3, "{said}");
    let line = said.split('`').find(|part| part.starts_with("<mimic"));
    let line = line.unwrap_or_else(|| panic!("{said}"));
    write("two.urdf", &two_links(line));
    let (code, found, said) = run_line(folder.path(), "new one --urdf two.urdf --log log.csv");
    assert_eq!(code, 0, "{said}");
    // the column that the file does not use raises no error
    let faults = found["faults"].to_string();
    assert!(!faults.contains("\"error\""), "{faults}");
    let (code, found, said) = run_line(folder.path(), "lsq log.csv -r one.toml -o m.toml");
    assert_eq!(code, 0, "{said}");
    let error = found["joints"][0]["relative_error_moving"]
        .as_f64()
        .unwrap();
    assert!(error < 0.01, "{error}");
    // without its columns `new` prints such a line
    let bare: String = moved_by_one_drive()
        .lines()
        .fold(String::new(), |text, row| {
            let mut fields: Vec<&str> = row.split(',').collect();
            fields.remove(4);
            fields.remove(2);
            text + &fields.join(",") + "\n"
        });
    write("bare.csv", &bare);
    write("apart.urdf", &two_links(""));
    let (code, found, said) = run_line(folder.path(), "new apart --urdf apart.urdf --log bare.csv");
    assert_eq!(code, 0, "{said}");
    let warnings = found["warnings"].to_string().replace('\\', "");
    let line = "<mimic joint=\"b\" multiplier=\"1\"/>";
    assert!(warnings.contains(line), "{warnings}");
}

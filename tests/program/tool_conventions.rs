//! What the numbers of a wrist sensor's orientation are is asked of the data.

use std::fmt::Write;

type Turn = [[f64; 3]; 3];

fn product_of(a: &Turn, b: &Turn) -> Turn {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Roll, pitch and yaw about fixed axes x, y, z \[rad\].
fn rotation_of([roll, pitch, yaw]: [f64; 3]) -> Turn {
    let ([sr, cr], [sp, cp]) = ([roll.sin(), roll.cos()], [pitch.sin(), pitch.cos()]);
    let [sy, cy] = [yaw.sin(), yaw.cos()];
    let x = [[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]];
    let y = [[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]];
    let z = [[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]];
    product_of(&z, &product_of(&y, &x))
}

#[test]
fn a_convention_of_angles_is_said_with_what_the_next_best_leaves() {
    let (mass, centre) = (1.37, [0.012, -0.021, 0.083]);
    let mut chance = 5_u64;
    let mut text = "t,roll,pitch,yaw,fx,fy,fz,tx,ty,tz\n".to_owned();
    for k in 0..300 {
        let pose = f64::from(k / 10);
        let angles = [2.1 * pose, 1.7 * pose, 2.9 * pose].map(|x: f64| 1.2 * x.sin());
        // the weight along the sensor's axes
        let down = rotation_of(angles)[2].map(|along| -mass * 9.80665 * along);
        let [x, y, z] = centre;
        let moment = [
            y * down[2] - z * down[1],
            z * down[0] - x * down[2],
            x * down[1] - y * down[0],
        ];
        let mut noise = |size: f64| {
            chance = chance
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            size * ((chance >> 33) as f64 / f64::from(1u32 << 31) - 0.5)
        };
        let force: Vec<f64> = down
            .iter()
            .zip([3.1, -2.4, 5.2])
            .map(|(f, b)| f + b + noise(0.1))
            .collect();
        let moment: Vec<f64> = moment.iter().map(|m| m + noise(0.005)).collect();
        let row = [&angles[..], &force, &moment].concat();
        let row: Vec<String> = row.iter().map(|x| format!("{x:.5}")).collect();
        writeln!(text, "{:.2},{}", 0.1 * f64::from(k), row.join(",")).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("poses.csv"), text).unwrap();
    let output = assert_cmd::Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder.path())
        .args(["tool", "poses.csv", "-o", "t.toml"])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let words: Vec<&str> = said.split_whitespace().collect();
    let said = words.join(" ");
    let sentence = said
        .split("orientations are ")
        .nth(1)
        .unwrap_or_else(|| panic!("{said}"));
    assert!(
        sentence.starts_with("roll, pitch and yaw about fixed x, y, z: read as "),
        "{sentence}"
    );
    // the next best is another one, and leaves many times the noise
    let words: Vec<&str> = sentence.split("the next best, ").collect();
    let error = words[1].split(' ').next().unwrap().parse::<f64>().unwrap();
    assert!(
        error > 1.0 && !words[0].contains("read as roll"),
        "{sentence}"
    );
    let heavy = said.split(' ').next().unwrap().parse::<f64>().unwrap();
    assert!((heavy - mass).abs() < 0.01, "{said}");
}

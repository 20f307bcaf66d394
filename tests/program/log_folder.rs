//! A folder with logs in which commands run.

use std::path::Path;

use serde_json::Value;

/// Two joints in a vertical plane.
pub const ARM: &str = r#"[robot]
model = "serial"
drive_inertia = false

[[robot.link]]
joint = "a"
rpy = [1.5707963267948966, 0.0, 0.0]

[[robot.link]]
joint = "b"
xyz = [0.4, 0.0, 0.0]

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true

[filter]
cutoff_hz = 8.0
"#;

/// Runs a command in a folder: status, document, and what it says.
pub fn run_line(folder: &Path, line: &str) -> (i32, Value, String) {
    let output = assert_cmd::Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder)
        .args(line.split_whitespace())
        .args(["--json", "-"])
        .output()
        .unwrap();
    let document = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let said = String::from_utf8(output.stderr).unwrap();
    (output.status.code().unwrap(), document, said)
}

//! Turns what `cargo bench --bench pipeline` left in target/criterion into docs/results/bench.json,
//! from which docs/speed.md has its table: `cargo run -p cft-ident-studies --example bench_summary`.

use std::path::Path;

use serde_json::{Value, json};

/// Benchmark, what it counts, and what it stands beside: a name and its samples per second.
const ROWS: &[(&str, &str, &str, f64)] = &[
    (
        "friction filter, 12 states/filter pass",
        "Kalman filter, one pass, 12 states",
        "plain numpy filter",
        24e3,
    ),
    (
        "friction filter, 12 states/score at fixed parameters",
        "the same with its parameters held",
        "plain numpy filter",
        24e3,
    ),
    (
        "regressor 4 x 12/regressor",
        "regressor of the CFT robot, 4 x 12",
        "Pinocchio (C++), 6 joints, with normal equations",
        300e3,
    ),
    (
        "regressor 4 x 12/regressor and R factor",
        "regressor folded into an R factor",
        "Pinocchio (C++), 6 joints, with normal equations",
        300e3,
    ),
];

fn main() {
    let read = |bench: &str, file: &str| -> Value {
        let path = Path::new("target/criterion")
            .join(bench)
            .join("new")
            .join(file);
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| {
            panic!(
                "{}: {e}; run `cargo bench --bench pipeline`",
                path.display()
            )
        });
        serde_json::from_str(&text).expect("criterion writes JSON")
    };
    let rows: Vec<Value> = ROWS
        .iter()
        .map(|(bench, what, beside, theirs)| {
            let samples = read(bench, "benchmark.json")["throughput"]["Elements"]
                .as_f64()
                .expect("a throughput");
            let nanoseconds = read(bench, "estimates.json")["median"]["point_estimate"]
                .as_f64()
                .expect("a median");
            let rate = samples / nanoseconds * 1e9;
            json!({
                "what, on one core": what,
                "million samples/s": format!("{:.2}", rate / 1e6),
                "beside": beside,
                "its thousand samples/s": format!("{:.0}", theirs / 1e3),
                "ratio": format!("{:.0}", rate / theirs),
            })
        })
        .collect();
    let document = json!({
        "study": "speed on one core",
        "command": "cargo bench --bench pipeline && cargo run -p cft-ident-studies --example bench_summary",
        "rows": rows,
    });
    std::fs::write("docs/results/bench.json", format!("{document:#}\n")).expect("it is written");
}

//! Datasets of LeRobot drawn by chance: episodes, files of both layouts, ways to name what a list holds, kinds of
//! numbers, and torques in another order than positions.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use parquet::data_type::{DataType, DoubleType, FloatType, Int64Type};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::log_drawn::{JOINTS, Motion, ROWS, drawn, mapped, read, same, shown};

/// Time between episodes [s].
const BETWEEN: f64 = 10.0;

/// How a dataset is written.
struct Dataset {
    /// First row of each episode, and of each file.
    episodes: Vec<usize>,
    files: Vec<usize>,
    /// One file an episode, as before version 3.
    by_episode: bool,
    doubles: bool,
    /// What the elements of lists are called.
    element: &'static str,
    torque: &'static str,
    /// Joints in the order of the torques; positions are in the order of the joints.
    order: [usize; 3],
}

/// Rows at which parts begin: at most `more` beside the first.
fn cuts(rng: &mut ChaCha8Rng, more: usize) -> Vec<usize> {
    let mut at: Vec<usize> = (0..rng.random_range(0..=more))
        .map(|_| rng.random_range(50..ROWS - 50))
        .collect();
    at.push(0);
    at.sort_unstable();
    at.dedup();
    at
}

impl Dataset {
    fn drawn(rng: &mut ChaCha8Rng) -> Self {
        let orders = [[0, 1, 2], [2, 0, 1], [1, 0, 2]];
        Self {
            episodes: cuts(rng, 3),
            files: cuts(rng, 2),
            by_episode: rng.random_bool(0.5),
            doubles: rng.random_bool(0.3),
            element: ["element", "item"][rng.random_range(0..2)],
            torque: ["effort", "torque"][rng.random_range(0..2)],
            order: orders[rng.random_range(0..3)],
        }
    }

    /// Episode and frame of a row.
    fn place(&self, row: usize) -> (i64, i64) {
        let episode = self.episodes.partition_point(|first| *first <= row) - 1;
        (episode as i64, (row - self.episodes[episode]) as i64)
    }

    /// Names of the lists by their joints, in one of the ways of descriptions.
    fn names(&self, rng: &mut ChaCha8Rng) -> [Value; 2] {
        let tail = ["", ".pos"][rng.random_range(0..2)];
        let kinds = rng.random_bool(0.5);
        let of = |order: [usize; 3], tail: &str| {
            let list = json!(order.map(|j| format!("{}{tail}", JOINTS[j])));
            if kinds {
                json!({ "motors": list })
            } else {
                list
            }
        };
        [of([0, 1, 2], tail), of(self.order, "")]
    }

    fn write(&self, rng: &mut ChaCha8Rng, motion: &Motion, folder: &Path) {
        let [q, tau] = self.names(rng);
        let about = |names: &Value| json!({ "dtype": "float32", "shape": [3], "names": names });
        let torque = format!("observation.{}", self.torque);
        let described = json!({
            "codebase_version": if self.by_episode { "v2.1" } else { "v3.0" },
            "fps": 100,
            "features": { "action": about(&q), "observation.state": about(&q), torque: about(&tau) },
        });
        let [meta, data] = ["meta", "data/chunk-000"].map(|part| folder.join(part));
        std::fs::create_dir_all(&meta).unwrap();
        std::fs::create_dir_all(&data).unwrap();
        std::fs::write(meta.join("info.json"), described.to_string()).unwrap();
        let firsts = if self.by_episode {
            &self.episodes
        } else {
            &self.files
        };
        for (k, first) in firsts.iter().enumerate() {
            let name = match self.by_episode {
                true => format!("episode_{k:06}.parquet"),
                false => format!("file-{k:03}.parquet"),
            };
            let end = firsts.get(k + 1).copied().unwrap_or(ROWS);
            let file = File::create(data.join(name)).unwrap();
            match self.doubles {
                true => self.file::<DoubleType>(motion, *first..end, file, &|x| x),
                false => self.file::<FloatType>(motion, *first..end, file, &|x| x as f32),
            }
        }
    }

    /// Writes some rows; the action is half a radian off, so that it cannot be taken for the position.
    fn file<T: DataType>(
        &self,
        motion: &Motion,
        rows: std::ops::Range<usize>,
        out: File,
        number: &dyn Fn(f64) -> T::T,
    ) {
        let (kind, element) = (if self.doubles { "DOUBLE" } else { "FLOAT" }, self.element);
        let list = |name: &str| {
            format!(
                "OPTIONAL group {name} (LIST) {{ REPEATED group list {{ OPTIONAL {kind} {element}; }} }}"
            )
        };
        let text = format!(
            "message schema {{ {} {} {} OPTIONAL INT64 frame_index; OPTIONAL INT64 episode_index; }}",
            list("action"),
            list("observation.state"),
            list(&format!("observation.{}", self.torque)),
        );
        let schema = Arc::new(parse_message_type(&text).unwrap());
        let mut writer = SerializedFileWriter::new(out, schema, Arc::default()).unwrap();
        let mut group = writer.next_row_group().unwrap();
        let action = |row: usize| motion.q[row].map(|q| q + 0.5);
        let lists: [&dyn Fn(usize) -> [f64; 3]; 3] = [&action, &|row| motion.q[row], &|row| {
            self.order.map(|j| motion.tau[row][j])
        }];
        for list in lists {
            let values: Vec<T::T> = rows.clone().flat_map(list).map(number).collect();
            let (whole, begins) = (vec![3; values.len()], [0, 1, 1].repeat(rows.len()));
            let mut column = group.next_column().unwrap().unwrap();
            let typed = column.typed::<T>();
            typed
                .write_batch(&values, Some(&whole), Some(&begins))
                .unwrap();
            column.close().unwrap();
        }
        let counts: [&dyn Fn(usize) -> i64; 2] =
            [&|row| self.place(row).1, &|row| self.place(row).0];
        for count in counts {
            let values: Vec<i64> = rows.clone().map(count).collect();
            let mut column = group.next_column().unwrap().unwrap();
            let typed = column.typed::<Int64Type>();
            typed
                .write_batch(&values, Some(&vec![1; values.len()]), None)
                .unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
        writer.close().unwrap();
    }
}

#[test]
fn drawn_datasets_of_episodes_are_read_exactly_and_episodes_stay_apart() {
    for seed in 6000..6000 + drawn() {
        let folder = tempfile::tempdir().unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut motion = Motion::drawn(&mut rng);
        let dataset = Dataset::drawn(&mut rng);
        if !dataset.doubles {
            let single = |row: &mut [f64; 3]| *row = row.map(|x| f64::from(x as f32));
            motion.q.iter_mut().chain(&mut motion.tau).for_each(single);
        }
        dataset.write(&mut rng, &motion, folder.path());
        let mut found = read(folder.path(), &mapped(folder.path())).unwrap();
        let begins: Vec<usize> = (1..found.t.len())
            .filter(|k| found.t[*k] - found.t[*k - 1] > 0.02)
            .collect();
        assert_eq!(begins, dataset.episodes[1..], "seed {seed}");
        for k in begins {
            let apart = found.t[k] - found.t[k - 1];
            assert!((apart - BETWEEN).abs() < 1e-9, "seed {seed}: {apart}");
            let later = &mut found.t[k..];
            later.iter_mut().for_each(|t| *t -= BETWEEN - 0.01);
        }
        same(&found, &motion, seed);
    }
    shown("datasets of LeRobot", 0);
}

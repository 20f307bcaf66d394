//! Files that never end, and files that are far too large for what they are given as.

use std::fs::File;
use std::os::unix::fs::symlink;

use crate::bench::Bench;

#[test]
fn no_text_file_is_read_without_a_bound() {
    let bench = Bench::new();
    symlink("/dev/zero", bench.path("zero.toml")).unwrap();
    symlink("/dev/zero", bench.path("zero.urdf")).unwrap();
    for line in [
        "lsq good.csv -r zero.toml -o out.toml",
        "lsq good.csv -r /dev/zero -o out.toml",
        "friction good.csv -r slide.toml -m zero.toml -o out.toml",
        "validate good.csv -m zero.toml",
        "diagnose good.csv -m /dev/zero -o out.toml",
        "torque good.csv -m zero.toml -o out.csv",
        "simulate -r slide.toml -m zero.toml -o out.csv",
        "simulate -r slide.toml --reference zero.toml -o out.csv",
        "excite --check zero.toml",
        "excite -r zero.toml -o out.toml",
        "export -m zero.toml --c out.h",
        "compare model.toml zero.toml",
        "identify zero.toml -o run",
        "inspect good.csv -r zero.toml",
        "convert good.csv out.mcap -r zero.toml",
        "new arm --urdf zero.urdf",
    ] {
        bench.refuses(line, 3, &["more than 16 MB", "below 16 MB"]);
    }
}

#[test]
fn a_log_and_a_model_that_were_exchanged_cost_no_memory() {
    let bench = Bench::new();
    for name in ["huge.csv", "huge.toml"] {
        // two gigabytes that take no room on the disk
        let file = File::create(bench.path(name)).unwrap();
        file.set_len(2 << 30).unwrap();
    }
    let log = ["is a log, not a robot or model file", "cft-ident new"];
    let large = ["more than 16 MB", "below 16 MB"];
    for (name, words) in [("huge.csv", log), ("huge.toml", large)] {
        bench.refuses(&format!("validate model.toml -m {name}"), 3, &words);
        bench.refuses(
            &format!("diagnose model.toml -m {name} -o out.toml"),
            3,
            &words,
        );
        bench.refuses(&format!("lsq good.csv -r {name} -o out.toml"), 3, &words);
    }
    bench.refuses("validate slide.toml -m good.csv", 3, &log);
}

#[test]
fn meshes_without_end_and_without_number_leave_links_without_capsules_and_memory_bounded() {
    let bench = Bench::new();
    symlink("/dev/zero", bench.path("zero.stl")).unwrap();
    let huge = File::create(bench.path("huge.stl")).unwrap();
    huge.set_len(2 << 30).unwrap();
    // 56 MB of vertices and blanks, named again and again
    let line = format!("vertex 1 2 3{}\n", " ".repeat(115));
    let lines = line.repeat((56 << 13) / 3 * 3);
    bench.file("dense.stl", format!("solid\n{lines}endsolid\n"));
    let shown = |files: &[&str]| {
        let shape = |file| {
            format!("<collision><geometry><mesh filename=\"{file}\"/></geometry></collision>")
        };
        let shapes: String = files.iter().map(shape).collect();
        let urdf = format!(
            "<robot name=\"arm\"><link name=\"base\"/><link name=\"upper\">{shapes}</link>\
             <joint name=\"q\" type=\"continuous\"><parent link=\"base\"/><child link=\"upper\"/></joint></robot>"
        );
        bench.file("arm.urdf", urdf);
        let ended = bench.run("new arm --urdf arm.urdf -v");
        assert_eq!(ended.status, Some(0), "{}", ended.stderr);
        std::fs::remove_file(bench.path("arm.toml")).unwrap();
        ended.stderr
    };
    let odd = shown(&["zero.stl", "huge.stl"]);
    assert!(odd.contains("there is no file zero.stl"), "{odd}");
    assert!(odd.contains("huge.stl: more than 64 MB"), "{odd}");
    let many = shown(&["dense.stl"; 1000]);
    let too_much = "dense.stl: the meshes of this URDF have more than 128 MB";
    assert!(
        many.contains(too_much) && many.contains("and 996 more of the kind"),
        "{many}"
    );
}

//! Settings that ask for more than a machine has are refused before anything is allocated.

use crate::bench::Bench;

#[test]
fn a_simulation_that_does_not_fit_into_memory_is_refused_at_once() {
    let bench = Bench::new();
    for seconds in ["1e12", "1e6", "1e29"] {
        let line = format!("simulate -r configs/cft.toml --seconds {seconds} -o out.csv");
        bench.refuses(&line, 3, &["rows that are simulated at once", "--seconds "]);
        let line = format!(
            "simulate -r slide.toml -m model.toml --move slide --seconds {seconds} -o out.mcap"
        );
        bench.refuses(&line, 3, &[]);
    }
    let fast = format!("{}\n[control]\nrate_hz = 1e12\n", crate::bench::SLIDE);
    bench.file("fast.toml", fast);
    bench.refuses(
        "simulate -r fast.toml -m model.toml --seconds 20 -o out.csv",
        3,
        &["Hz are more than", "rows that are"],
    );
}

#[test]
fn a_trajectory_of_extreme_frequency_or_duration_is_reported_and_not_computed() {
    let bench = Bench::new();
    let table3 = cft_ident::config::embedded("configs/table3.toml".as_ref())
        .unwrap()
        .to_owned();
    let at = table3.find("\nfundamental_hz").unwrap() + 1;
    let end = at + table3[at..].find('\n').unwrap();
    for (hz, words) in [
        ("1e5", ["periods of 100000.0 Hz", "lower `fundamental_hz`"]),
        ("1000.0", ["periods of 1000.0 Hz", "lower `fundamental_hz`"]),
        ("1e29", ["periods of 1e29 Hz", "lower `fundamental_hz`"]),
        ("1e308", ["high.toml:", "finite numbers of at most 1e30"]),
    ] {
        let text = format!("{}fundamental_hz = {hz}{}", &table3[..at], &table3[end..]);
        bench.file("high.toml", text);
        bench.refuses("excite --check high.toml", 3, &words);
    }
    let offset = |number: &str| {
        let at = table3.find("\noffset").unwrap() + 1;
        let end = at + table3[at..].find(['\n', ',']).unwrap();
        format!("{}offset = {number}{}", &table3[..at], &table3[end..])
    };
    bench.file("far.toml", offset("1e308"));
    bench.refuses("excite --check far.toml", 3, &["far.toml:", "at most 1e30"]);
    bench.refuses(
        "simulate -r configs/cft.toml --reference far.toml -o out.csv",
        3,
        &["far.toml:"],
    );
    bench.file("far.toml", offset("1e29"));
    for line in [
        "excite --check far.toml",
        "simulate -r configs/cft.toml --reference far.toml -o out.csv",
    ] {
        let ended = bench.run(line);
        assert!(matches!(ended.status, Some(1 | 3)), "{line}: {ended:?}");
        assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
    }
    let points = "kind = \"points\"\ncoordinates = \"joint\"\n[[point]]\nt = 0.0\nposition = [0.0]\n\
                  [[point]]\nt = 1e29\nposition = [0.1]\n";
    bench.file("long.toml", points);
    for line in [
        "excite -r slide.toml -m model.toml --check long.toml",
        "simulate -r slide.toml -m model.toml --reference long.toml -o out.csv",
    ] {
        let ended = bench.run(line);
        assert_eq!(ended.status, Some(3), "{line}: {ended:?}");
        assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
    }
    let ended = bench.run("excite -r configs/cft.toml -o out.toml --frequency 5000");
    assert_eq!(ended.status, Some(2), "{ended:?}");
}

#[test]
fn a_robot_file_of_a_hundred_thousand_links_is_refused_by_its_line() {
    let bench = Bench::new();
    let mut text = "[robot]\nmodel = \"serial\"\n".to_owned();
    for k in 0..100_000 {
        text.push_str(&format!("[[robot.link]]\njoint = \"j{k}\"\na = 0.1\n"));
    }
    bench.file("long.toml", text);
    for line in [
        "lsq good.csv -r long.toml -o out.toml",
        "simulate -r long.toml -o out.csv",
        "excite -r long.toml -o out.toml",
        "inspect good.csv -r long.toml",
    ] {
        bench.refuses(line, 3, &["long.toml:", "100000 links", "at most 200"]);
    }
}

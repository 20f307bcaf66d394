//! A motion as SAGE (isaac-sim2real) writes it: a folder with `control.csv` and `state_motor.csv`, a list of numbers in
//! a cell for all joints, time in microseconds.

/// The columns of a folder.
#[derive(Debug, Clone, PartialEq)]
pub struct SageLog {
    pub t: Vec<f64>,
    /// Joint after joint.
    pub position: Vec<Vec<f64>>,
    pub command: Vec<Vec<f64>>,
}

/// Names of the two files.
pub const FILES: [&str; 2] = ["control.csv", "state_motor.csv"];

/// Rows of time [s] and numbers.
type Rows = Vec<(f64, Vec<f64>)>;

/// Reads the texts of both files. `Err` says what is wrong.
pub fn read(control: &str, state: &str) -> Result<SageLog, String> {
    let commands = rows(control).map_err(|what| format!("{}: {what}", FILES[0]))?;
    let states = rows(state).map_err(|what| format!("{}: {what}", FILES[1]))?;
    let wide = states[0].1.len();
    if commands[0].1.len() != wide {
        let other = commands[0].1.len();
        return Err(format!(
            "{} joints are commanded and {wide} measured",
            other
        ));
    }
    let mut out = SageLog {
        t: Vec::with_capacity(states.len()),
        position: vec![Vec::with_capacity(states.len()); wide],
        command: vec![Vec::with_capacity(states.len()); wide],
    };
    let mut at = 0;
    for (t, numbers) in &states {
        // the command that was sent last
        while at + 1 < commands.len() && commands[at + 1].0 <= *t {
            at += 1;
        }
        out.t.push(*t);
        for (signal, number) in out.position.iter_mut().zip(numbers) {
            signal.push(*number);
        }
        for (signal, number) in out.command.iter_mut().zip(&commands[at].1) {
            signal.push(*number);
        }
    }
    Ok(out)
}

/// The rows of a file, in increasing time.
fn rows(text: &str) -> Result<Rows, String> {
    let mut lines = text.lines().enumerate();
    let head = lines.next().map_or("", |(_, line)| line);
    let names: Vec<&str> = head.split(',').map(str::trim).collect();
    let column = |name: &str| {
        let at = names.iter().position(|n| *n == name);
        at.ok_or_else(|| format!("has no column `{name}`"))
    };
    let (time, positions) = (column("timestamp")?, column("positions")?);
    let mut out = Rows::new();
    for (k, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let wrong = |what: &str| format!("line {}: {what}", k + 1);
        let cells = cells(line);
        let cell = |at: usize| cells.get(at).ok_or_else(|| wrong("is too short"));
        let t: f64 = cell(time)?
            .trim()
            .parse()
            .map_err(|_| wrong("its time is no number"))?;
        let list: Vec<f64> = serde_json::from_str(cell(positions)?)
            .map_err(|_| wrong("its positions are no list of numbers"))?;
        if out
            .first()
            .is_some_and(|(_, first)| first.len() != list.len())
            || list.is_empty()
        {
            return Err(wrong("its number of joints is another"));
        }
        if let Some((last, _)) = out.last()
            && (t * MICROSECOND <= *last || t.is_nan())
        {
            return Err(wrong("its time does not increase"));
        }
        out.push((t * MICROSECOND, list));
    }
    match out.is_empty() {
        true => Err("holds no row".to_owned()),
        false => Ok(out),
    }
}

const MICROSECOND: f64 = 1e-6;

/// Cells of a line, quoted ones whole.
fn cells(line: &str) -> Vec<String> {
    let mut out = vec![String::new()];
    let mut quoted = false;
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => out.push(String::new()),
            c => {
                if let Some(last) = out.last_mut() {
                    last.push(c);
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATE: &str = "type,timestamp,positions,velocities\n\
        STATE_MOTOR,5.0,\"[0.1, 0.2]\",\"[0, 0]\"\n\
        STATE_MOTOR,20100.5,\"[0.3, 0.4]\",\"[0, 0]\"\n";

    #[test]
    fn lists_in_cells_become_columns_and_each_row_has_the_command_sent_last() {
        let control =
            "type,timestamp,positions\nCONTROL,5.0,\"[1, 2]\"\nCONTROL,19000,\"[3, 4]\"\n";
        let log = read(control, STATE).unwrap();
        assert_eq!(log.position, [[0.1, 0.3], [0.2, 0.4]]);
        assert_eq!(log.command, [[1.0, 3.0], [2.0, 4.0]]);
        assert!((log.t[1] - 20_100.5e-6).abs() < 1e-15);
    }

    #[test]
    fn what_is_wrong_is_said_with_file_and_line() {
        for (control, expected) in [
            ("type,positions\n", "control.csv: has no column `timestamp`"),
            (
                "timestamp,positions\n5,\"[1]\"\n",
                "1 joints are commanded and 2 measured",
            ),
            (
                "timestamp,positions\n5,\"[1, 2]\"\n5,\"[1, 2]\"\n",
                "line 3: its time does not increase",
            ),
            (
                "timestamp,positions\n5,oops\n",
                "line 2: its positions are no list",
            ),
        ] {
            let error = read(control, STATE).unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
    }
}

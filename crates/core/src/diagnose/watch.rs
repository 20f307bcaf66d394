//! What a diagnosis says while it works, and whether it is to end.

use super::error::DiagnoseError;

/// What a diagnosis says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiagnosisProgress<'a> {
    /// A part of the search begins: its name, and how many steps it takes. How many parts will follow is not known
    /// before the search ends.
    Begin(&'a str, u64),
    /// A step of it is done.
    Step,
    /// The part that began last ends.
    End,
}

/// Who is informed, from any thread, and who says whether to end.
#[derive(Clone, Copy)]
pub struct DiagnosisWatch<'a> {
    pub tell: &'a (dyn Fn(DiagnosisProgress) + Sync),
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> DiagnosisWatch<'a> {
    /// An error where the search is to end.
    pub(crate) fn unless_stopped(self) -> Result<(), DiagnoseError> {
        match (self.stop)() {
            true => Err(DiagnoseError::Interrupted),
            false => Ok(()),
        }
    }

    /// Begins a part of `steps` steps, which ends when the guard is dropped.
    pub(crate) fn part(self, name: &str, steps: usize) -> SearchPart<'a> {
        (self.tell)(DiagnosisProgress::Begin(name, steps as u64));
        SearchPart(self)
    }
}

/// A part of the search that is under way.
pub(crate) struct SearchPart<'a>(DiagnosisWatch<'a>);

impl SearchPart<'_> {
    /// One more of its steps is done.
    pub(crate) fn step(&self) {
        (self.0.tell)(DiagnosisProgress::Step);
    }
}

impl Drop for SearchPart<'_> {
    fn drop(&mut self) {
        (self.0.tell)(DiagnosisProgress::End);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn a_part_is_distinguished_from_its_begin_to_its_end() {
        let heard = Mutex::new(Vec::new());
        let tell = |h: DiagnosisProgress| heard.lock().unwrap().push(format!("{h:?}"));
        let watch = DiagnosisWatch {
            tell: &tell,
            stop: &|| false,
        };
        let part = watch.part("round 1", 2);
        part.step();
        part.step();
        drop(part);
        let heard = heard.lock().unwrap();
        let expected = ["Begin(\"round 1\", 2)", "Step", "Step", "End"];
        assert_eq!(*heard, expected);
    }
}

//! The width of the window that a text is for.

use std::io::IsTerminal;

use cft_ident_report::report::table::WIDTH;

/// A stream that may lead to a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stream {
    Output,
    Error,
}

/// Columns of the narrowest and of the widest text: a sentence across all of a large screen is hard to read.
const COLUMNS: [usize; 2] = [40, 120];

/// Columns of the window behind the stream; those of a file or a pipe are always the same.
pub(super) fn columns(stream: Stream) -> usize {
    let (seen, size) = match stream {
        Stream::Output => (
            std::io::stdout().is_terminal(),
            terminal_size::terminal_size_of(std::io::stdout()),
        ),
        Stream::Error => (
            std::io::stderr().is_terminal(),
            terminal_size::terminal_size_of(std::io::stderr()),
        ),
    };
    match size.filter(|_| seen) {
        Some((terminal_size::Width(width), _)) => within(usize::from(width)),
        None => WIDTH,
    }
}

fn within(columns: usize) -> usize {
    columns.clamp(COLUMNS[0], COLUMNS[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_used_to_a_width_that_can_be_read() {
        assert_eq!([20, 72, 300].map(within), [40, 72, 120]);
        // tests have no window, as a file has none
        assert_eq!(columns(Stream::Output), WIDTH);
    }
}

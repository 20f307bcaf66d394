#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    cft_ident::cli::main()
}

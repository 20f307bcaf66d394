//! `LOG:mass=KG[+-STD]`: a log in which the arm carries a payload of known mass.

use cft_ident_core::explain::Explain;
use std::str::FromStr;

use cft_ident_logs::log::{LogSpec, escape};
use cft_ident_stages::identify::{Log, PayloadLog};

/// A log with a payload whose mass is known.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownPayload {
    pub log: LogSpec,
    /// \[kg\]
    pub mass: f64,
    /// Its standard deviation \[kg\].
    pub std: f64,
}

/// Why a text is no such log.
#[derive(Debug, Clone, PartialEq, Explain, thiserror::Error)]
pub enum PayloadError {
    #[explain(
        "`{_0}` is not LOG:mass=KG or LOG:mass=KG+-STD, e.g. loaded.csv:mass=2.8+-0.05",
        "logs without a payload stand before --fit-gains"
    )]
    Form(String),
    #[explain(
        "`{_0}` is no mass",
        "give kilograms above 0, and a standard deviation from 0 on"
    )]
    Mass(String),
    #[explain("{_0}")]
    Log(String),
}

impl FromStr for KnownPayload {
    type Err = PayloadError;

    fn from_str(text: &str) -> Result<Self, PayloadError> {
        let form = || PayloadError::Form(escape(text));
        let (log, mass) = text.rsplit_once(":mass=").ok_or_else(form)?;
        let number = |word: &str, least_above: bool| {
            let word = word.trim().trim_end_matches("kg").trim_end();
            let value: f64 = word.parse().unwrap_or(f64::NAN);
            let usable = value.is_finite() && (value > 0.0 || (!least_above && value == 0.0));
            usable
                .then_some(value)
                .ok_or_else(|| PayloadError::Mass(escape(mass)))
        };
        let (mass_word, std) = match mass.split_once("+-").or_else(|| mass.split_once('±')) {
            Some((mass, std)) => (mass, number(std, false)?),
            None => (mass, 0.0),
        };
        Ok(KnownPayload {
            mass: number(mass_word, true)?,
            std,
            log: log
                .parse()
                .map_err(|error: cft_ident_logs::log::LogError| {
                    PayloadError::Log(error.to_string())
                })?,
        })
    }
}

impl KnownPayload {
    /// The same for the library.
    pub fn known(&self) -> PayloadLog {
        PayloadLog {
            log: Log::from(&self.log),
            mass: self.mass,
            std: self.std,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_its_mass_and_the_deviation_of_it_are_read() {
        let read = |text: &str| text.parse::<KnownPayload>().unwrap();
        let found = read("a/loaded.csv@0..70%:mass=2.8+-0.05");
        assert_eq!((found.mass, found.std), (2.8, 0.05));
        assert_eq!(found.log.to_string(), "a/loaded.csv@0..70%");
        assert_eq!(read("b.csv:mass=3kg").std, 0.0);
        assert_eq!(read("b.csv:mass=3 ± 0.1").std, 0.1);
    }

    #[test]
    fn what_is_no_mass_is_told() {
        let error = |text: &str| text.parse::<KnownPayload>().unwrap_err().to_string();
        assert!(error("loaded.csv").contains("is not LOG:mass=KG"));
        for text in [
            "a.csv:mass=0",
            "a.csv:mass=-1",
            "a.csv:mass=x",
            "a.csv:mass=1+--2",
        ] {
            assert!(error(text).contains("is no mass"), "{text}");
        }
    }
}

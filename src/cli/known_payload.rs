//! `LOG:mass=KG[+-STD]`: a log in which the arm carries a payload of known mass.

use cft_ident_core::explain::ErrorText;
use std::str::FromStr;

use cft_ident_logs::log::{LogError, LogSpec, escape};
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

impl FromStr for KnownPayload {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = || {
            let what = format!(
                "`{}` is not LOG:mass=KG or LOG:mass=KG+-STD, e.g. loaded.csv:mass=2.8+-0.05",
                escape(text)
            );
            let remedy = "logs without a payload stand before --fit-gains";
            ErrorText::new(what).remedy(remedy).to_string()
        };
        let (log, mass) = text.rsplit_once(":mass=").ok_or_else(form)?;
        let number = |word: &str, from_zero: bool| {
            let word = word.trim().trim_end_matches("kg").trim_end();
            let value: f64 = word.parse().unwrap_or(f64::NAN);
            let usable = value.is_finite() && (value > 0.0 || from_zero && value == 0.0);
            let what = format!("`{}` is no mass", escape(mass));
            let remedy = "give kilograms above 0, and a standard deviation from 0 on";
            let wrong = ErrorText::new(what).remedy(remedy);
            usable.then_some(value).ok_or(wrong.to_string())
        };
        let (mass_word, std) = match mass.split_once("+-").or_else(|| mass.split_once('±')) {
            Some((mass, std)) => (mass, number(std, true)?),
            None => (mass, 0.0),
        };
        Ok(KnownPayload {
            mass: number(mass_word, false)?,
            std,
            log: log.parse().map_err(|error: LogError| error.to_string())?,
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
    fn a_text_without_a_mass_is_refused() {
        let error = |text: &str| text.parse::<KnownPayload>().unwrap_err();
        assert!(error("loaded.csv").contains("is not LOG:mass=KG"));
        for mass in ["0", "-1", "x", "1+--2"] {
            assert!(
                error(&format!("a.csv:mass={mass}")).contains("is no mass"),
                "{mass}"
            );
        }
    }
}

//! Objectives of a search: quantities of a case at a load, and limits on them.

use std::fmt;
use std::str::FromStr;

use elastocap_case::{Amount, Case, Load, Scale};
use elastocap_coupling::load_steps::StepLoad;
use elastocap_coupling::outcome::{Outcome, Status, StepResult};

/// The distance of the loads of a difference quotient from the given load, over that load, for sensitivities.
pub const DIFFERENCE: f64 = 0.15;

/// A quantity of a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantity {
    /// `C0`: the capacitance without load, F.
    RestCapacitance,
    /// `C at LOAD`, F.
    Capacitance(AtLoad),
    /// `change at LOAD`: |C - C0|, F.
    Change(AtLoad),
    /// `sensitivity at LOAD`: |dC/dF|, F/N.
    Sensitivity(AtLoad),
    /// `force at COMPRESSION`, N.
    Force(f64),
}

/// A load above zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AtLoad {
    /// A force, N.
    Force(f64),
    /// A compression U/H, below 1.
    Compression(f64),
}

/// The reason why a text does not name a quantity or a limit, or why several do not go together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WishError {
    /// The quantity is unknown.
    #[error(
        "`{0}` is not known; write C0, or one of `C`, `change`, `sensitivity` at a force or a compression, or `force` at a compression, \
         such as \"sensitivity at 0.1 N\" or \"change at 0.2\""
    )]
    Quantity(String),
    /// The load is not a force above zero, nor a compression between 0 and 1.
    #[error(
        "`{0}` is not a load; write a force above zero with its unit, such as 0.1 N, or a compression between 0 and 1, such as 0.2"
    )]
    Load(String),
    /// A force is asked for at a force instead of a compression.
    #[error("`{0}`: a force is asked for at a compression, such as \"force at 0.2\"")]
    ForceAtForce(String),
    /// The limit has no `<` or `>`.
    #[error("`{0}` has no < or >; write for example \"C0 > 1pF\"")]
    Comparison(String),
    /// The limit has another unit than the quantity.
    #[error("`{text}`: the limit is {found}, and its unit must be {unit}")]
    Limit {
        /// The text of the limit.
        text: String,
        /// The dimension of the given amount with its article, or the reason why it is not an amount.
        found: String,
        /// The unit that it should have: F, F/N or N.
        unit: &'static str,
    },
    /// Some quantities are at forces and others at compressions.
    #[error("all loads of one search must be forces, or all compressions")]
    MixedLoads,
}

/// The reason why a run does not give a quantity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoValue {
    /// No step has a load that the quantity needs.
    #[error("the run has no step at a load of {0}")]
    NoStep(f64),
    /// A step has no capacitance; the text is its status.
    #[error("{0}")]
    NoCapacitance(Box<Status>),
    /// A step has no force.
    #[error("the force at this load is not known")]
    NoForce,
    /// The force does not grow between the steps of a derivative.
    #[error("the force does not grow with the compression there")]
    ForceDoesNotGrow,
}

impl Quantity {
    /// The SI unit of the quantity.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::RestCapacitance | Self::Capacitance(_) | Self::Change(_) => "F",
            Self::Sensitivity(_) => "F/N",
            Self::Force(_) => "N",
        }
    }

    /// The load that the quantity is at; `None` for the state without load.
    fn load(&self) -> Option<AtLoad> {
        match *self {
            Self::RestCapacitance => None,
            Self::Capacitance(load) | Self::Change(load) | Self::Sensitivity(load) => Some(load),
            Self::Force(compression) => Some(AtLoad::Compression(compression)),
        }
    }

    /// The loads that the quantity needs in addition to the state without load.
    fn needs(&self) -> Vec<f64> {
        let Some(load) = self.load() else { return Vec::new() };
        let (AtLoad::Force(load_value) | AtLoad::Compression(load_value)) = load;
        match (self, load) {
            (Self::Sensitivity(_), AtLoad::Force(_)) => {
                vec![load_value * (1.0 - DIFFERENCE), load_value * (1.0 + DIFFERENCE)]
            }
            // No compression reaches 1.
            (Self::Sensitivity(_), AtLoad::Compression(_)) => {
                let step = (DIFFERENCE * load_value).min(0.5 * (1.0 - load_value));
                vec![load_value - step, load_value + step]
            }
            _ => vec![load_value],
        }
    }

    /// The value in a run of [`case_at`], in its SI unit, and its error from bounds and stated errors.
    ///
    /// # Errors
    /// [`NoValue`] if a step that the quantity needs is missing, or has no capacitance or force.
    pub fn value(&self, outcome: &Outcome) -> Result<(f64, f64), NoValue> {
        let rest = step_at(outcome, 0.0)?;
        let (c0, e0) = capacitance(rest)?;
        let Some(load) = self.load() else { return Ok((c0, e0)) };
        let (AtLoad::Force(load_value) | AtLoad::Compression(load_value)) = load;
        match self {
            Self::RestCapacitance => Ok((c0, e0)),
            Self::Capacitance(_) => capacitance(step_at(outcome, load_value)?),
            Self::Change(_) => {
                let (c, e) = capacitance(step_at(outcome, load_value)?)?;
                Ok(((c - c0).abs(), e + e0))
            }
            Self::Force(_) => force(step_at(outcome, load_value)?),
            Self::Sensitivity(_) => {
                let around = self.needs();
                let [low, high] = [around[0], around[1]].map(|load| step_at(outcome, load));
                let (low, high) = (low?, high?);
                let ((c1, e1), (c2, e2)) = (capacitance(low)?, capacitance(high)?);
                let ((f1, g1), (f2, g2)) = (force(low)?, force(high)?);
                let width = f2 - f1;
                if width <= 0.0 {
                    return Err(NoValue::ForceDoesNotGrow);
                }
                let value = ((c2 - c1) / width).abs();
                // First order in the errors of capacitances and forces.
                Ok((value, (e1 + e2 + value * (g1 + g2)) / width))
            }
        }
    }
}

/// The step at a load; a load of zero is the state without load.
fn step_at(outcome: &Outcome, load: f64) -> Result<&StepResult, NoValue> {
    let has_load = |step: &&StepResult| match step.load {
        StepLoad::None => load == 0.0,
        StepLoad::Compression(step_load) | StepLoad::ForceN(step_load) => step_load == load,
    };
    outcome.steps.iter().find(has_load).ok_or(NoValue::NoStep(load))
}

/// The force of a step and its stated error, N.
fn force(step: &StepResult) -> Result<(f64, f64), NoValue> {
    let value = step.row.force_n.ok_or(NoValue::NoForce)?;
    let error = step.layer.as_ref().and_then(|layer| layer.relative_error_estimate).unwrap_or(0.0);
    Ok((value, error * value.abs()))
}

/// The capacitance of a step and its error from bounds and stated errors, F.
fn capacitance(step: &StepResult) -> Result<(f64, f64), NoValue> {
    let no_capacitance = || NoValue::NoCapacitance(Box::new(step.row.status.clone()));
    let value = step.row.capacitance_f.ok_or_else(no_capacitance)?;
    Ok((value, value.abs() * step.row.error_in_model().unwrap_or(0.0)))
}

/// The case with the loads that these quantities need, and no others.
///
/// # Errors
/// [`WishError::MixedLoads`] if some need forces and others compressions.
pub fn case_at(mut case: Case, quantities: &[Quantity]) -> Result<Case, WishError> {
    let kinds: Vec<AtLoad> = quantities.iter().filter_map(Quantity::load).collect();
    let by_force = kinds.iter().any(|load| matches!(load, AtLoad::Force(_)));
    if by_force && kinds.iter().any(|load| matches!(load, AtLoad::Compression(_))) {
        return Err(WishError::MixedLoads);
    }
    let mut loads: Vec<f64> = quantities.iter().flat_map(Quantity::needs).chain([0.0]).collect();
    loads.sort_by(f64::total_cmp);
    loads.dedup();
    case.load = Some(if by_force { Load::Force(loads) } else { Load::Compression(loads) });
    case.poses = Vec::new();
    if let Some(settings) = &mut case.electrostatics {
        settings.change_tolerance = None;
    }
    Ok(case)
}

impl fmt::Display for AtLoad {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Force(force) => write!(f, "{force} N"),
            Self::Compression(compression) => write!(f, "{compression}"),
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RestCapacitance => f.write_str("C0"),
            Self::Capacitance(load) => write!(f, "C at {load}"),
            Self::Change(load) => write!(f, "change at {load}"),
            Self::Sensitivity(load) => write!(f, "sensitivity at {load}"),
            Self::Force(compression) => write!(f, "force at {compression}"),
        }
    }
}

impl FromStr for Quantity {
    type Err = WishError;

    fn from_str(text: &str) -> Result<Self, WishError> {
        let text = text.trim();
        if text.eq_ignore_ascii_case("c0") {
            return Ok(Self::RestCapacitance);
        }
        let unknown = || WishError::Quantity(text.to_owned());
        let (name, load) = text.split_once(" at ").ok_or_else(unknown)?;
        let amount: Amount = load.parse().map_err(|_| WishError::Load(load.to_owned()))?;
        let load = match amount.scale.dimension_name() {
            "a force" if amount.si > 0.0 => AtLoad::Force(amount.si),
            "a number" if amount.si > 0.0 && amount.si < 1.0 => AtLoad::Compression(amount.si),
            _ => return Err(WishError::Load(load.to_owned())),
        };
        match (name.trim().to_lowercase().as_str(), load) {
            ("c", load) => Ok(Self::Capacitance(load)),
            ("change", load) => Ok(Self::Change(load)),
            ("sensitivity", load) => Ok(Self::Sensitivity(load)),
            ("force", AtLoad::Compression(compression)) => Ok(Self::Force(compression)),
            ("force", AtLoad::Force(_)) => Err(WishError::ForceAtForce(text.to_owned())),
            _ => Err(unknown()),
        }
    }
}

/// A limit on a quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Constraint {
    /// The limited quantity.
    pub quantity: Quantity,
    /// Whether the limit is a lower one; otherwise it is an upper one.
    pub at_least: bool,
    /// The limit, in the SI unit of the quantity.
    pub limit: f64,
    /// The scale in which the limit was written.
    pub scale: Scale,
}

impl Constraint {
    /// The distance of a value from the limit, over the limit; negative if the value is not allowed.
    pub fn margin(&self, value: f64) -> f64 {
        let beyond = if self.at_least { value - self.limit } else { self.limit - value };
        beyond / if self.limit == 0.0 { 1.0 } else { self.limit.abs() }
    }
}

impl FromStr for Constraint {
    type Err = WishError;

    fn from_str(text: &str) -> Result<Self, WishError> {
        let place = text.find(['<', '>']).ok_or_else(|| WishError::Comparison(text.to_owned()))?;
        let (quantity, rest) = text.split_at(place);
        let at_least = rest.starts_with('>');
        let limit = rest.trim_start_matches(['<', '>', '=']).trim();
        let quantity: Quantity = quantity.parse()?;
        let unit = quantity.unit();
        let wrong = |found: String| WishError::Limit { text: text.to_owned(), found, unit };
        let amount: Amount = limit.parse().map_err(|_| wrong("not a number with a unit".to_owned()))?;
        let expected: Amount = format!("1 {unit}").parse().map_err(|_| wrong("not known".to_owned()))?;
        if !amount.scale.fits(&expected.scale) {
            return Err(wrong(amount.scale.dimension_name().to_owned()));
        }
        Ok(Self { quantity, at_least, limit: amount.si, scale: amount.scale })
    }
}

impl fmt::Display for Constraint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.at_least { ">" } else { "<" };
        write!(f, "{} {sign} {}", self.quantity, self.scale.show(self.limit, 4))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_are_read_and_shown_as_they_were_written() {
        for (text, quantity) in [
            ("C0", Quantity::RestCapacitance),
            ("C at 0.1 N", Quantity::Capacitance(AtLoad::Force(0.1))),
            ("change at 0.2", Quantity::Change(AtLoad::Compression(0.2))),
            ("sensitivity at 0.1 N", Quantity::Sensitivity(AtLoad::Force(0.1))),
            ("force at 0.25", Quantity::Force(0.25)),
        ] {
            let read: Quantity = text.parse().unwrap();
            assert_eq!((read, read.to_string().as_str()), (quantity, text));
        }
        assert_eq!("Sensitivity at 100mN".parse(), Ok(Quantity::Sensitivity(AtLoad::Force(0.1))));
    }

    #[test]
    fn what_cannot_be_wished_for_says_why() {
        for (text, words) in [
            ("beauty at 0.1 N", "is not known"),
            ("sensitivity", "is not known"),
            ("sensitivity at 0 N", "is not a load"),
            ("C at 1.5", "is not a load"),
            ("C at 1 mm", "is not a load"),
            ("force at 0.1 N", "at a compression"),
        ] {
            let message = text.parse::<Quantity>().unwrap_err().to_string();
            assert!(message.contains(words), "{text}: {message}");
        }
        for (text, words) in [
            ("C0 = 1pF", "no < or >"),
            ("C0 > 1 mN", "a force"),
            ("C0 > much", "not a number"),
            ("sensitivity at 0.1 N > 1 pF", "F/N"),
        ] {
            let message = text.parse::<Constraint>().unwrap_err().to_string();
            assert!(message.contains(words), "{text}: {message}");
        }
    }

    #[test]
    fn a_margin_is_positive_on_the_allowed_side() {
        let least: Constraint = "C0 > 30 fF".parse().unwrap();
        assert!((least.margin(33e-15) - 0.1).abs() < 1e-12 && least.margin(27e-15) < 0.0);
        let most: Constraint = "sensitivity at 0.1 N <= 50 fF/N".parse().unwrap();
        assert!(most.margin(60e-15) < 0.0);
        assert_eq!(least.to_string(), "C0 > 30.00 fF");
    }
}

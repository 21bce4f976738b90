//! Errors of input that this crate refuses.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use thiserror::Error;

/// The reason why a layer, a load or an electrode was refused. All values are SI.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum MechanicsError {
    /// A quantity that has to be positive and finite is not.
    #[error("the {quantity} is {value} {unit}, but it must be positive and finite; give a value above zero")]
    NotPositive {
        /// The name of the quantity, in words.
        quantity: &'static str,
        /// The refused value.
        value: f64,
        /// Its SI unit.
        unit: &'static str,
    },
    /// The compression `U/H` is not in `[0, 1)`.
    #[error(
        "the compression U/H is {compression}, but it must be at least 0 and less than 1 (1 leaves no layer); \
         give the fraction of the thickness, such as 0.2 for 20 %"
    )]
    Compression {
        /// The refused `U/H`, without unit.
        compression: f64,
    },
    /// The compressive force is negative or not finite.
    #[error(
        "the force is {force} N, but it must be finite and not negative; \
         compression counts as positive, and pulling on the layer is not modelled"
    )]
    Force {
        /// The refused force in N.
        force: f64,
    },
    /// No compression of the closed form gives this much force.
    #[error(
        "the force is {force} N, but the closed form reaches only {largest_force} N, at a compression U/H of \
         {compression}; lower the force, or check the contact length and width, the thickness and the modulus"
    )]
    ForceOutOfReach {
        /// The refused force in N.
        force: f64,
        /// The largest force of the closed form with these settings, in N.
        largest_force: f64,
        /// The compression `U/H` at which it is reached.
        compression: f64,
    },
    /// A foam is compressed more than its table was measured.
    #[error(
        "the compression U/H is {compression}, but the table of the foam's stress ends at {last_compression}; measure further, \
         or lower the load"
    )]
    BeyondTable {
        /// The refused `U/H`, without unit.
        compression: f64,
        /// The last `U/H` of the table.
        last_compression: f64,
    },
    /// A foam is pressed by a larger force than its table has.
    #[error(
        "the force is {force} N, but the table of the foam's stress reaches only {largest_force} N on this contact, at a compression \
         U/H of {last_compression}; measure further, lower the force, or check the contact length and width"
    )]
    BeyondTableForce {
        /// The refused force in N.
        force: f64,
        /// The force at the last stress of the table in N.
        largest_force: f64,
        /// The last `U/H` of the table.
        last_compression: f64,
    },
    /// The table of a foam has the same stress over a range of compressions.
    #[error(
        "the force is {force} N, and the table of the foam's stress has it at every compression U/H from {from} to {to}; \
         load by `compression` there"
    )]
    Plateau {
        /// The refused force in N.
        force: f64,
        /// The first `U/H` with this force.
        from: f64,
        /// The last `U/H` with this force.
        to: f64,
    },
    /// The contact is so long compared with the shear length that the force of equation (50) is tensile from
    /// the start.
    #[error(
        "with a contact half-length of {contact_half_length} m and a shear length of {shear_length} m on a layer \
         {thickness} m thick, equation (50) of the paper (Large deformation mechanics of a soft elastomeric layer under \
         compressive loading for a MEMS tactile sensor application) gives no compressive force; make the shear length at least \
         the contact half-length divided by 1.73"
    )]
    ForceDoesNotRise {
        /// `L` of equation (50) in m.
        contact_half_length: f64,
        /// `L` of equation (45) in m.
        shear_length: f64,
        /// `H` in m.
        thickness: f64,
    },
    /// An electrode's mid-plane is not inside the layer.
    #[error(
        "the electrode's mid-plane is {height} m above the substrate, outside the layer of thickness {thickness} m; \
         give a height between 0 and the thickness"
    )]
    ElectrodeOutsideLayer {
        /// The refused reference height `S` in m.
        height: f64,
        /// `H` in m.
        thickness: f64,
    },
}

/// Returns `value` if it is positive and finite.
pub(crate) fn require_positive(
    quantity: &'static str,
    value: f64,
    unit: &'static str,
) -> Result<f64, MechanicsError> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(MechanicsError::NotPositive { quantity, value, unit })
    }
}

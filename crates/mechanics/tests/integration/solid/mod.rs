//! The finite-element solver against solutions it does not know.

mod contact;
mod cook;
mod extreme;
mod foam;
mod gent;
mod layer;
mod off_the_middle;
mod patch;
mod rounded;
mod sharp;
mod shear_length;
mod space;
mod stress;

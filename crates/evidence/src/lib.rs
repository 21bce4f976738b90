//! Evidence for the accuracy of the program: errors against run time, a catalogue of extreme cases, and the
//! figures of the paper.
//!
//! These are clients of [`elastocap_coupling`], like any other program.

pub mod accuracy;
pub mod figures;
pub mod stability;

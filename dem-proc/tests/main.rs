//! The solver from outside: one program, a module for each subject.

mod alone;
mod small_scenes;

mod approach;
mod cells;
mod closed_forms;
mod continuity;
mod convex_measures;
mod impacts;
mod kit;
mod laws;
mod leaving;
mod limits;
mod mass_properties;
mod opening;
mod passage;
mod point_contact;
mod reference;
mod refusals;
mod saved;
mod segments;
mod sound_runs;

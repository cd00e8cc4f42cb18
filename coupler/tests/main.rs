//! The reader of scenes from outside: one program, a module for each subject.

mod bad_scenes;
mod changed_scenes;
mod doubts;
mod long_scenes;
mod needs;
mod placement;
mod scene_files;
mod scenes;
mod schema;
mod slice;

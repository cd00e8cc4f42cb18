//! The reader of scenes from outside: one program, a module for each subject.

mod bad_scenes;
mod long_scenes;
mod needs;
mod scene_files;
mod scenes;

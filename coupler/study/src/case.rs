//! One run of many: a scene with the values that it takes in this run.

use std::path::{Path, PathBuf};

use clap::Args;
use coupler::scene::Scene;
use coupler::scene::diagnostic::SceneErrors;

use crate::StudyError;
use crate::vary::{PLAIN, Setting, VARIANT};

/// A scene with overrides.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub struct Source {
    /// Scene file.
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
    /// Named variant of the scene, such as `quick`.
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Override a scene key, such as `mpm.cell=0.002`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// A run of a scene, checked.
#[derive(Debug, Clone)]
pub struct Case {
    /// Its difference from the others.
    pub settings: Vec<Setting>,
    /// The scene as it runs.
    pub scene: Scene,
    /// [`Scene::solver_files`] before any run.
    pub solver_files: Option<String>,
}

impl Source {
    /// The scene with more keys set, after those of the user.
    ///
    /// # Errors
    /// What is wrong with the scene.
    pub fn load_with(&self, more: &[String]) -> Result<Scene, SceneErrors> {
        Scene::load(
            &self.path,
            self.variant.as_deref(),
            &[&self.set, more].concat(),
        )
    }

    /// Title of the scene and its variant.
    pub fn title(&self) -> String {
        let variant = self.variant.as_deref().map(|v| format!(" ({v})"));
        scene_title(&self.path) + &variant.unwrap_or_default()
    }

    /// The scene with these settings.
    ///
    /// # Errors
    /// [`StudyError::Scene`], with the words of `tandem run` for a bad `--set`.
    pub fn case(&self, settings: &[Setting]) -> Result<Case, StudyError> {
        let mut variant = self.variant.as_deref();
        let mut set = self.set.clone();
        for (key, value) in settings {
            if key == VARIANT {
                variant = Some(value.as_str()).filter(|name| *name != PLAIN);
            } else {
                set.push(format!("{key}={value}"));
            }
        }
        let load = |set: &[String]| Scene::load(&self.path, variant, set);
        let mut scene = load(&set).map_err(StudyError::Scene)?;
        if scene.output.report {
            // The runs of a study are timed, and nobody opens a page of each.
            set.push("output.report=false".to_owned());
            scene = load(&set).map_err(StudyError::Scene)?;
        }
        Ok(Case {
            settings: settings.to_vec(),
            solver_files: scene.solver_files(),
            scene,
        })
    }
}

impl Case {
    /// The number at a dotted key of the scene as it runs, or, where that spells it otherwise, as it was set.
    pub fn number(&self, key: &str) -> Option<f64> {
        let set = || {
            let setting = self.settings.iter().find(|(known, _)| known == key)?;
            setting.1.parse().ok()
        };
        self.resolved(key).or_else(set)
    }

    fn resolved(&self, key: &str) -> Option<f64> {
        let root = toml::Value::Table(self.scene.resolved_toml.parse().ok()?);
        let within = key
            .split('.')
            .try_fold(&root, |at, segment| match segment.parse::<usize>() {
                Ok(place) => at.get(place),
                Err(_) => at.get(segment),
            });
        let number = within?;
        number
            .as_float()
            .or_else(|| Some(number.as_integer()? as f64))
    }

    /// The settings for people, but for those of some keys; each by the last part of its key.
    pub fn label(&self, without: &[String]) -> String {
        let shown = self
            .settings
            .iter()
            .filter(|(key, _)| !without.contains(key));
        let words = shown.map(|(key, value)| match key.rsplit_once('.') {
            // The number of an element says nothing without its list.
            Some((_, last)) if last.parse::<usize>().is_err() => format!("{last} {value}"),
            _ => format!("{key} {value}"),
        });
        words.collect::<Vec<_>>().join(", ")
    }
}

/// The folder of a scene file and its name: `jiang2020/silo` of `scenes/jiang2020/silo.toml`.
pub fn scene_title(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    match path.parent().and_then(Path::file_name) {
        Some(folder) if folder != "scenes" => format!("{}/{stem}", folder.to_string_lossy()),
        _ => stem.into_owned(),
    }
}

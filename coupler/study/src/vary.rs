//! `--vary KEY=V1,V2,...`: the values that a scene key takes, and all combinations of several.

use crate::StudyError;

/// The word that stands for a variant of the scene in place of a scene key.
pub const VARIANT: &str = "variant";
/// The value of [`VARIANT`] that stands for the scene without one.
pub const PLAIN: &str = "plain";

/// A scene key, or [`VARIANT`], and its values as `--set` takes them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Vary {
    /// Dotted key.
    pub key: String,
    /// At least one.
    pub values: Vec<String>,
}

/// A key and the value that it has in a run.
pub type Setting = (String, String);

impl Vary {
    /// Of `KEY=V1,V2,...`. Commas within brackets, braces and quotes belong to a value.
    ///
    /// # Errors
    /// [`StudyError::Usage`].
    pub fn parse(argument: &str) -> Result<Self, StudyError> {
        let wrong = |what: String| {
            let help = "write `--vary mpm.cell=0.01,0.005`; values are those of `--set`";
            StudyError::usage(format!("--vary {argument}: {what}"), help)
        };
        let (key, values) = argument
            .split_once('=')
            .ok_or_else(|| wrong("there is no `=`".into()))?;
        let key = key.trim();
        if key.is_empty() {
            return Err(wrong("no key before the `=`".into()));
        }
        let values = split(values).map_err(wrong)?;
        if values.iter().any(String::is_empty) {
            return Err(wrong("a value is empty".into()));
        }
        if let Some(twice) = twice(&values) {
            return Err(wrong(format!("the value {twice} is there twice")));
        }
        Ok(Self {
            key: key.to_owned(),
            values,
        })
    }

    /// The values as numbers, if all are.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        self.values.iter().map(|v| v.parse().ok()).collect()
    }
}

/// A key with its unit, if the last part of the key determines it.
pub fn with_unit(key: &str) -> String {
    let unit = match key.rsplit('.').next().unwrap_or(key) {
        "normal_stiffness" | "tangential_stiffness" => "N/m",
        "cell" | "sphero_radius" | "contact_radius" | "distance" | "skin" => "m",
        "max_step" | "end" | "every" => "s",
        "density" => "kg/m^3",
        "mass" => "kg/m",
        "bulk_modulus" | "shear_modulus" => "Pa",
        _ => return key.to_owned(),
    };
    format!("{key} in {unit}")
}

/// All combinations, the last key changing fastest.
///
/// # Errors
/// [`StudyError::Usage`] when a key is there twice.
pub fn combinations(vary: &[Vary]) -> Result<Vec<Vec<Setting>>, StudyError> {
    let keys: Vec<String> = vary.iter().map(|v| v.key.clone()).collect();
    if let Some(key) = twice(&keys) {
        return Err(StudyError::usage(
            format!("`{key}` is varied twice"),
            "give all its values at once: `--vary KEY=V1,V2`",
        ));
    }
    let mut all = vec![Vec::new()];
    for vary in vary {
        let extend = |settings: &Vec<Setting>| {
            let settings = settings.clone();
            vary.values.iter().map(move |value| {
                let mut longer = settings.clone();
                longer.push((vary.key.clone(), value.clone()));
                longer
            })
        };
        all = all.iter().flat_map(extend).collect();
    }
    Ok(all)
}

pub(crate) fn twice(texts: &[String]) -> Option<&String> {
    let mut earlier = texts.iter().enumerate();
    earlier.find_map(|(i, text)| texts[..i].contains(text).then_some(text))
}

/// Splits at the commas that are in no bracket, brace or quote.
pub(crate) fn split(text: &str) -> Result<Vec<String>, String> {
    let mut values = vec![String::new()];
    let mut open = Vec::new();
    let mut quote = None;
    let mut escaped = false;
    for c in text.chars() {
        let value = values.last_mut().expect("there is one from the start");
        if c == ',' && open.is_empty() && quote.is_none() {
            values.push(String::new());
            continue;
        }
        value.push(c);
        match quote {
            Some(mark) => {
                if escaped {
                    escaped = false;
                } else if c == '\\' && mark == '"' {
                    escaped = true;
                } else if c == mark {
                    quote = None;
                }
            }
            None => match c {
                '"' | '\'' => quote = Some(c),
                '[' => open.push(']'),
                '{' => open.push('}'),
                '(' => open.push(')'),
                ']' | '}' | ')' if open.pop() != Some(c) => {
                    return Err(format!("`{c}` closes nothing"));
                }
                _ => {}
            },
        }
    }
    if let Some(mark) = quote.or(open.pop()) {
        return Err(format!("a closing `{mark}` is missing"));
    }
    Ok(values.iter().map(|v| v.trim().to_owned()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_has_its_unit() {
        assert_eq!(with_unit("mpm.cell"), "mpm.cell in m");
        assert_eq!(with_unit("time.safety"), "time.safety");
    }

    fn values(argument: &str) -> Vec<String> {
        Vary::parse(argument).unwrap().values
    }

    #[test]
    fn commas_within_brackets_braces_and_quotes_belong_to_a_value() {
        assert_eq!(values("a.b=1, 2e-3 ,x"), ["1", "2e-3", "x"]);
        assert_eq!(values("a=[1, 2],[3,[4,5]]"), ["[1, 2]", "[3,[4,5]]"]);
        assert_eq!(
            values("mpm.transfer=flip,{ blend = { pic_fraction = 0.1, x = [1,2] } }"),
            ["flip", "{ blend = { pic_fraction = 0.1, x = [1,2] } }"]
        );
        assert_eq!(
            values(r#"a="x,y",'p,"q',"a\",b""#),
            [r#""x,y""#, r#"'p,"q'"#, r#""a\",b""#]
        );
        // The first `=` ends the key.
        assert_eq!(Vary::parse(" k = {a=1}").unwrap().key, "k");
    }

    #[test]
    fn what_is_no_list_of_values_is_refused() {
        for (argument, phrase) in [
            ("mpm.cell", "there is no `=`"),
            ("=1", "no key"),
            ("a=", "a value is empty"),
            ("a=1,,2", "a value is empty"),
            ("a=1,2,1", "the value 1 is there twice"),
            ("a=[1,2", "a closing `]` is missing"),
            ("a=[1}", "`}` closes nothing"),
            ("a=\"x", "a closing `\"` is missing"),
        ] {
            let message = Vary::parse(argument).unwrap_err().to_string();
            assert!(message.contains(phrase), "{argument}: {message}");
        }
    }

    #[test]
    fn combinations_are_all_and_in_order() {
        let vary: Vec<Vary> = ["a=1,2", "b=x,y,z"]
            .iter()
            .map(|a| Vary::parse(a).unwrap())
            .collect();
        let all = combinations(&vary).unwrap();
        assert_eq!(all.len(), 6);
        let values: Vec<String> = all.iter().map(|s| s[0].1.clone() + &s[1].1).collect();
        assert_eq!(values, ["1x", "1y", "1z", "2x", "2y", "2z"]);
        assert_eq!(combinations(&[]).unwrap(), [Vec::new()]);
        let twice = [vary[0].clone(), vary[0].clone()];
        assert!(combinations(&twice).is_err());
    }
}

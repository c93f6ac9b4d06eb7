//! The parameters of a file's variations: which of them tell the variations apart, and how each number follows from them.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use avastra_campaign::emit::identifier;

use super::said::Figure;
use super::scene::TAKEN;
use super::variation::Values;

/// Parameters with more combinations than this in one action are drawn, not listed; so are those with more over all actions and roads.
const EACH_MAX: usize = 1_000;
const ALL_MAX: usize = 30_000;

/// How far a line may miss a number: one in its last place.
const MISSED: f64 = 1.0001e-4;

/// The most decimals of a line's figures, and of one that is said in another unit.
const PLACES_MAX: usize = 9;
const ROUND_PLACES: usize = 2;

/// The parameters that tell the variations apart.
#[derive(Debug)]
pub struct Parameters {
    pub list: Vec<Parameter>,
    /// For each variation the index of each parameter's value.
    rows: Vec<Vec<usize>>,
    /// Functions that numbers need: their texts, and their names.
    functions: Vec<(String, String)>,
    /// The parameters that are drawn in some action.
    pub drawn: BTreeSet<String>,
}

#[derive(Debug)]
pub struct Parameter {
    pub name: String,
    kind: Kind,
    /// As the language writes them, in the order of the file.
    values: Vec<String>,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Number(Vec<f64>),
    Truth,
    /// The name of its enum.
    Word(String),
}

impl Parameters {
    /// The fewest parameters that tell the variations apart. If several say the same, a speed stays, else a number, else
    /// a word; among equals the first one stays. `names` are those of road users.
    pub fn of(order: &[String], variations: &[&Values], names: &BTreeSet<&str>) -> Parameters {
        let texts = |name: &String| -> Vec<&str> {
            variations.iter().map(|values| values.get(name).map_or("", String::as_str)).collect()
        };
        let mut kept: Vec<(&String, Vec<&str>)> = order
            .iter()
            .map(|name| (name, texts(name)))
            .filter(|(_, texts)| texts.iter().any(|text| text != &texts[0]))
            .collect();
        let worth = |name: &str, texts: &[&str]| match () {
            () if name.to_lowercase().contains("speed") => 3,
            () if texts.iter().all(|text| text.parse::<f64>().is_ok()) => 2,
            // Paths of files say least to a reader.
            () => usize::from(!texts.iter().any(|text| text.contains(['/', '\\']))),
        };
        let mut leaving: Vec<(usize, &String)> =
            kept.iter().rev().map(|(name, texts)| (worth(name, texts), *name)).collect();
        leaving.sort_by_key(|(worth, _)| *worth);
        for (_, name) in leaving {
            let others: Vec<&Vec<&str>> =
                kept.iter().filter(|(other, _)| *other != name).map(|(_, texts)| texts).collect();
            let tuples: BTreeSet<Vec<&str>> =
                (0..variations.len()).map(|at| others.iter().map(|texts| texts[at]).collect()).collect();
            if tuples.len() == variations.len() {
                kept.retain(|(other, _)| *other != name);
            }
        }
        let mut taken: BTreeSet<String> = TAKEN.map(str::to_owned).into();
        for name in names {
            taken.extend([(*name).to_owned(), format!("{name}_way"), format!("{name}_does")]);
        }
        let mut rows = vec![Vec::new(); variations.len()];
        let mut list = Vec::new();
        for (name, texts) in kept {
            let own = unique(&small(name), &mut taken);
            let (parameter, indices) = Parameter::of(own, &texts);
            for (row, index) in rows.iter_mut().zip(indices) {
                row.push(index);
            }
            list.push(parameter);
        }
        Parameters { list, rows, functions: Vec::new(), drawn: BTreeSet::new() }
    }

    /// The enums of parameters that are words.
    pub fn enums(&self) -> String {
        let mut text = String::new();
        for parameter in &self.list {
            if let Kind::Word(name) = &parameter.kind {
                let _ = writeln!(text, "enum {name} = {}", parameter.values.join(" | "));
            }
        }
        text
    }

    /// The functions that numbers needed so far.
    pub fn functions(&self) -> impl Iterator<Item = &str> {
        self.functions.iter().map(|(_, text)| text.as_str())
    }

    /// The parameters of an action that stands for some of the variations, with what combines no values otherwise than they do.
    /// `times` is how many actions there are, by how many roads.
    pub fn declared(&mut self, group: &[usize], times: usize) -> String {
        let most = EACH_MAX.min(ALL_MAX / times.max(1));
        let mut declared = Vec::new();
        let mut count: usize = 1;
        let all: Vec<usize> = (0..self.list.len()).collect();
        for at in 0..self.list.len() {
            let values = self.values(group, at);
            count = count.saturating_mul(values.len());
            let word = if count > most { "any" } else { "each" };
            if word == "any" {
                self.drawn.insert(self.list[at].name.clone());
            }
            let parameter = &self.list[at];
            let listed: Vec<&str> = values.iter().map(|value| parameter.values[*value].as_str()).collect();
            let mut text =
                format!("{word} {}: {} in [{}]", parameter.name, parameter.type_name(), listed.join(", "));
            // Asked where all that it needs is there.
            let known = self.tuples(group, &all[..=at]);
            let before = self.tuples(group, &all[..at]);
            if known.len() < before.len() * values.len()
                && let Some(condition) = self.condition(&known, &all[..=at], group)
            {
                let _ = write!(text, " where {condition}");
            }
            declared.push(text);
        }
        declared.join(", ")
    }

    /// A condition that holds of the variations with each of some properties, as a disjunction: `road == a and x == 1 or …`.
    pub fn cases<T: Ord + Clone>(
        &self,
        group: &[usize],
        property: impl Fn(usize) -> T,
        said: impl Fn(&T) -> String,
    ) -> String {
        let needed = self.needed(group, &|at| property(at));
        let mut by: BTreeMap<T, Vec<usize>> = BTreeMap::new();
        for at in group {
            by.entry(property(*at)).or_default().push(*at);
        }
        let cases: Vec<String> = by
            .iter()
            .map(|(value, rows)| {
                let said = said(value);
                match self.condition(&self.tuples(rows, &needed), &needed, group) {
                    Some(condition) => format!("({said} and {condition})"),
                    None => said,
                }
            })
            .collect();
        either(&cases)
    }

    /// A name for each of the variations, by the values that decide a property.
    pub fn names<T: PartialEq>(&self, group: &[usize], property: impl Fn(usize) -> T) -> Vec<String> {
        let needed = self.needed(group, &property);
        let name = |at: &usize| {
            let values = needed.iter().map(|one| self.list[*one].values[self.rows[*at][*one]].as_str());
            let text = values.collect::<Vec<_>>().join("_");
            text.replace('-', "minus_").replace('.', "_")
        };
        group.iter().map(name).collect()
    }

    /// A number of the language that has these values in the variations of a group.
    pub fn number(&mut self, group: &[usize], figures: &[Figure], name: &str) -> String {
        if figures.iter().all(|figure| *figure == figures[0]) {
            return figures[0].text();
        }
        let of: BTreeMap<usize, Figure> = group.iter().copied().zip(figures.iter().copied()).collect();
        let needed = self.needed(group, &|at| of[&at]);
        if let [only] = needed.as_slice()
            && let Kind::Number(values) = &self.list[*only].kind
        {
            let by: BTreeMap<usize, f64> =
                group.iter().map(|at| (self.rows[*at][*only], of[at].value())).collect();
            let points: Vec<(f64, f64)> =
                by.into_iter().map(|(value, figure)| (values[value], figure)).collect();
            if let Some(line) = line(&points, figures[0].unit, &self.list[*only].name) {
                return line;
            }
        }
        self.function(group, &of, &needed, name)
    }

    /// A call of a function that lists the values.
    fn function(
        &mut self,
        group: &[usize],
        of: &BTreeMap<usize, Figure>,
        needed: &[usize],
        name: &str,
    ) -> String {
        let names: Vec<&str> = needed.iter().map(|at| self.list[*at].name.as_str()).collect();
        let typed: Vec<String> = needed
            .iter()
            .map(|at| format!("{}: {}", self.list[*at].name, self.list[*at].type_name()))
            .collect();
        let kind = of[&group[0]].type_name();
        let rest = format!("({}) -> {kind} = {}", typed.join(", "), self.listed(group, of, needed));
        let known = self.functions.iter().find(|(_, text)| text.ends_with(&rest));
        let name = match known {
            Some((name, _)) => name.clone(),
            None => {
                let mut taken = self.functions.iter().map(|(name, _)| name.clone()).collect();
                let own = unique(name, &mut taken);
                self.functions.push((own.clone(), format!("fn {own}{rest}")));
                own
            }
        };
        format!("{name}({})", names.join(", "))
    }

    /// A `match` for each parameter within that of the one before it.
    fn listed(&self, group: &[usize], of: &BTreeMap<usize, Figure>, needed: &[usize]) -> String {
        let Some((first, rest)) = needed.split_first() else { return of[&group[0]].text() };
        let values = self.values(group, *first);
        let parameter = &self.list[*first];
        let mut cases: Vec<(String, Vec<&str>)> = Vec::new();
        for value in values {
            let rows: Vec<usize> =
                group.iter().copied().filter(|at| self.rows[*at][*first] == value).collect();
            let text = self.listed(&rows, of, rest);
            match cases.iter_mut().find(|(known, _)| *known == text) {
                Some((_, values)) => values.push(&parameter.values[value]),
                None => cases.push((text, vec![&parameter.values[value]])),
            }
        }
        if let [(text, _)] = cases.as_slice() {
            return text.clone();
        }
        let last = cases.len() - 1;
        let cases: Vec<String> = cases
            .iter()
            .enumerate()
            .map(|(nth, (text, values))| match nth {
                _ if nth == last => format!("_ => {text}"),
                _ => format!("{} => {text}", values.join(" | ")),
            })
            .collect();
        format!("match {} {{ {} }}", parameter.name, cases.join(", "))
    }

    /// The fewest parameters on which something depends.
    fn needed<T: PartialEq>(&self, group: &[usize], property: &dyn Fn(usize) -> T) -> Vec<usize> {
        let decides = |chosen: &[usize]| {
            let mut known: BTreeMap<Vec<usize>, T> = BTreeMap::new();
            group.iter().all(|at| {
                let key = chosen.iter().map(|one| self.rows[*at][*one]).collect();
                let value = property(*at);
                match known.get(&key) {
                    Some(there) => *there == value,
                    None => {
                        known.insert(key, value);
                        true
                    }
                }
            })
        };
        let all: Vec<usize> = (0..self.list.len()).collect();
        if decides(&[]) {
            return Vec::new();
        }
        if let Some(one) = all.iter().find(|one| decides(&[**one])) {
            return vec![*one];
        }
        let mut needed = all.clone();
        for one in all.iter().rev() {
            let less: Vec<usize> = needed.iter().copied().filter(|other| other != one).collect();
            if decides(&less) {
                needed = less;
            }
        }
        needed
    }

    /// The values of a parameter in some variations: numbers upwards, words in the order of the file.
    fn values(&self, group: &[usize], parameter: usize) -> Vec<usize> {
        let found: BTreeSet<usize> = group.iter().map(|at| self.rows[*at][parameter]).collect();
        found.into_iter().collect()
    }

    fn tuples(&self, group: &[usize], chosen: &[usize]) -> BTreeSet<Vec<usize>> {
        group.iter().map(|at| chosen.iter().map(|one| self.rows[*at][*one]).collect()).collect()
    }

    /// The condition that holds for some tuples of values alone, among those that are possible in a group; `None` if it
    /// holds for all.
    fn condition(&self, tuples: &BTreeSet<Vec<usize>>, chosen: &[usize], group: &[usize]) -> Option<String> {
        let (first, rest) = chosen.split_first()?;
        let mut by: BTreeMap<usize, BTreeSet<Vec<usize>>> = BTreeMap::new();
        for tuple in tuples {
            by.entry(tuple[0]).or_default().insert(tuple[1..].to_vec());
        }
        // Values after which the same may follow are told together.
        let mut merged: Vec<(Vec<usize>, &BTreeSet<Vec<usize>>)> = Vec::new();
        for (value, after) in &by {
            match merged.iter_mut().find(|(_, known)| *known == after) {
                Some((values, _)) => values.push(*value),
                None => merged.push((vec![*value], after)),
            }
        }
        let possible = self.values(group, *first).len();
        let parameter = &self.list[*first];
        let cases: Vec<Option<String>> = merged
            .iter()
            .map(|(values, after)| {
                let own = (values.len() < possible).then(|| parameter.is_one_of(values));
                match (own, self.condition(after, rest, group)) {
                    (None, None) => None,
                    (Some(one), None) | (None, Some(one)) => Some(one),
                    (Some(own), Some(after)) => Some(format!("({own} and {after})")),
                }
            })
            .collect();
        cases.into_iter().collect::<Option<Vec<String>>>().map(|cases| either(&cases))
    }
}

impl Parameter {
    /// A parameter, and for each of the texts which of its values it is.
    fn of(name: String, texts: &[&str]) -> (Parameter, Vec<usize>) {
        let finite = |text: &&str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        if let Some(numbers) = texts.iter().map(finite).collect::<Option<Vec<f64>>>() {
            let mut distinct = numbers.clone();
            distinct.sort_by(f64::total_cmp);
            distinct.dedup();
            let at = |number: &f64| distinct.partition_point(|value| value < number);
            let row = numbers.iter().map(at).collect();
            let values = distinct.iter().map(f64::to_string).collect();
            return (Parameter { name, kind: Kind::Number(distinct), values }, row);
        }
        if texts.iter().all(|text| matches!(*text, "true" | "false")) {
            let row = texts.iter().map(|text| usize::from(*text == "true")).collect();
            let values = vec!["false".to_owned(), "true".to_owned()];
            return (Parameter { name, kind: Kind::Truth, values }, row);
        }
        let mut distinct: Vec<&str> = Vec::new();
        let mut places: BTreeMap<&str, usize> = BTreeMap::new();
        let mut row = Vec::new();
        for text in texts {
            let at = *places.entry(text).or_insert(distinct.len());
            if at == distinct.len() {
                distinct.push(text);
            }
            row.push(at);
        }
        // The last part of a path, without its ending, says which one it is.
        let short = |text: &str| {
            let last = text.rsplit(['/', '\\']).next().unwrap_or(text);
            capital(last.split('.').next().unwrap_or(last))
        };
        let mut taken = BTreeSet::new();
        let values = distinct.iter().map(|text| unique(&short(text), &mut taken)).collect();
        let kind = Kind::Word(format!("{}Of", capital(&name)));
        (Parameter { name, kind, values }, row)
    }

    fn type_name(&self) -> &str {
        match &self.kind {
            Kind::Number(_) => "Ratio",
            Kind::Truth => "Bool",
            Kind::Word(name) => name,
        }
    }

    fn is_one_of(&self, values: &[usize]) -> String {
        let texts: Vec<&str> = values.iter().map(|value| self.values[*value].as_str()).collect();
        match texts.as_slice() {
            [one] => format!("{} == {one}", self.name),
            _ => format!("{} in [{}]", self.name, texts.join(", ")),
        }
    }
}

/// A line through points, as the language writes it; `None` if they lie on none.
fn line(points: &[(f64, f64)], unit: &'static str, name: &str) -> Option<String> {
    let count = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(&|point| point.0), mean(&|point| point.1));
    let spread = mean(&|point| (point.0 - x) * (point.0 - x));
    let slope = mean(&|point| (point.0 - x) * (point.1 - y)) / spread;
    let through_zero = mean(&|point| point.0 * point.1) / mean(&|point| point.0 * point.0);
    let holds = |slope: f64, more: f64| {
        points.iter().all(|(x, y)| (slope * x + more - y).abs() <= MISSED) && slope.is_finite()
    };
    // A part of a speed in km/h, or the way at one in so many seconds, is written so.
    let mut shapes = vec![(1.0, " * ", unit)];
    match unit {
        "m/s" => shapes.insert(0, (3.6, " * ", "km/h")),
        "m" => shapes.insert(0, (3.6, " * 1 km/h * ", "s")),
        _ => {}
    }
    for places in 0..=PLACES_MAX {
        let rounded = |value: f64| format!("{value:.places$}").parse::<f64>().unwrap_or(value);
        for (times, before, after) in &shapes {
            if *times != 1.0 && places > ROUND_PLACES {
                continue;
            }
            for (slope, more) in [(through_zero, 0.0), (slope, y - slope * x)] {
                let (slope, more) = (rounded(slope * times), rounded(more));
                // Two points lie on any line: only a multiple is taken for more than a coincidence.
                if !holds(slope / times, more) || more != 0.0 && points.len() < 3 {
                    continue;
                }
                let multiple = format!("{name}{before}{slope} {after}");
                let said = if more == 0.0 { multiple } else { format!("{multiple} + {more} {unit}") };
                return Some(said.trim_end().to_owned());
            }
        }
    }
    None
}

/// One of these holds. Halved again and again, because operators may not stand in one another too deep.
fn either(cases: &[String]) -> String {
    match cases {
        [] => "false".to_owned(),
        [one] => one.clone(),
        _ => {
            let (first, second) = cases.split_at(cases.len() / 2);
            format!("({} or {})", either(first), either(second))
        }
    }
}

/// A name of the language in small letters: `gvt_following_distance` of `GVT_followingDistance`.
pub fn small(name: &str) -> String {
    let mut spaced = String::new();
    let mut was_small = false;
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && was_small {
            spaced.push('_');
        }
        was_small = letter.is_ascii_lowercase();
        spaced.push(letter.to_ascii_lowercase());
    }
    identifier(&spaced)
}

/// A name of the language for types and bodies: `NcapBicycle` of `NCAP_bicycle`.
pub fn capital(name: &str) -> String {
    let name = small(name);
    let words = name.split('_').map(|word| {
        let mut letters = word.chars();
        letters
            .next()
            .map_or_else(String::new, |first| first.to_ascii_uppercase().to_string() + letters.as_str())
    });
    words.collect()
}

/// A name that was not taken before.
pub fn unique(name: &str, taken: &mut BTreeSet<String>) -> String {
    let own = (1..).map(|nth| if nth == 1 { name.to_owned() } else { format!("{name}_{nth}") });
    let own = own.into_iter().find(|name| !taken.contains(name)).unwrap_or_default();
    taken.insert(own.clone());
    own
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parameters of some variations, given as `name=value` words.
    fn parameters(order: &[&str], variations: &[&str]) -> Parameters {
        let order: Vec<String> = order.iter().map(|name| (*name).to_owned()).collect();
        let values: Vec<Values> = variations
            .iter()
            .map(|text| {
                let pairs = text.split_whitespace().map(|pair| pair.split_once('=').expect("name=value"));
                pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).collect()
            })
            .collect();
        Parameters::of(&order, &values.iter().collect::<Vec<_>>(), &["lead"].into())
    }

    #[test]
    fn what_follows_from_others_is_no_parameter() {
        let variations =
            ["kmh=30 id=a far=10 same=1", "kmh=40 id=b far=20 same=1", "kmh=50 id=c far=20 same=1"];
        let found = parameters(&["id", "kmh", "far", "same"], &variations);
        let names: Vec<&str> = found.list.iter().map(|parameter| parameter.name.as_str()).collect();
        assert_eq!(names, ["kmh"], "a speed stays");
        assert_eq!(found.enums(), "");
    }

    #[test]
    fn words_make_an_enum_and_what_is_not_combined_is_left_out() {
        let variations = ["who=Cars/van.xml kmh=30", "who=car kmh=30", "who=car kmh=40"];
        let mut found = parameters(&["who", "kmh"], &variations);
        assert_eq!(found.enums(), "enum WhoOf = Van | Car\n");
        let declared = "each who: WhoOf in [Van, Car], each kmh: Ratio in [30, 40] where ((who == Van and kmh == 30) or who == Car)";
        assert_eq!(found.declared(&[0, 1, 2], 1), declared);
        assert_eq!(found.declared(&[1, 2], 1), "each who: WhoOf in [Car], each kmh: Ratio in [30, 40]");
        let cases = found.cases(&[0, 1, 2], |at| at == 2, |far| format!("far == {far}"));
        assert_eq!(cases, "((far == false and kmh == 30) or (far == true and kmh == 40))");
        assert_eq!(found.names(&[0, 2], |at| at), ["Van", "Car"]);
    }

    #[test]
    fn names_of_the_language_and_of_road_users_are_changed() {
        let found = parameters(
            &["lead", "Lead_way", "in"],
            &["lead=1 Lead_way=1 in=1", "lead=1 Lead_way=2 in=1", "lead=2 Lead_way=2 in=3"],
        );
        let names: Vec<&str> = found.list.iter().map(|parameter| parameter.name.as_str()).collect();
        assert_eq!(names, ["lead_2", "lead_way_2"]);
        assert_eq!(parameters(&["in"], &["in=1", "in=2"]).list[0].name, "in_2");
    }

    #[test]
    fn beyond_the_most_rows_the_last_parameters_are_drawn() {
        let all: Vec<String> = (0..1200).map(|at| format!("a={} b={}", at % 40, at / 40)).collect();
        let mut found = parameters(&["a", "b"], &all.iter().map(String::as_str).collect::<Vec<_>>());
        let group: Vec<usize> = (0..1200).collect();
        let declared = found.declared(&group, 1);
        assert!(declared.contains("each a: ") && declared.contains("any b: "), "{declared}");
        assert_eq!(found.drawn, ["b".to_owned()].into());
    }

    #[test]
    fn numbers_are_multiples_lines_or_tables_of_parameters() {
        let variations = ["kmh=20 far=1", "kmh=30 far=1", "kmh=40 far=2"];
        let mut found = parameters(&["kmh"], &variations);
        let said = |found: &mut Parameters, unit, values: [f64; 3]| {
            found.number(&[0, 1, 2], &values.map(|value| Figure::new(value, unit)), "it")
        };
        assert_eq!(said(&mut found, "m/s", [20.0 / 3.6, 30.0 / 3.6, 40.0 / 3.6]), "kmh * 1 km/h");
        assert_eq!(said(&mut found, "m", [10.0 / 3.6, 15.0 / 3.6, 20.0 / 3.6]), "kmh * 1 km/h * 0.5 s");
        assert_eq!(said(&mut found, "m", [7.0, 9.0, 11.0]), "kmh * 0.2 m + 3 m");
        assert_eq!(said(&mut found, "s", [2.0, 2.0, 2.0]), "2 s");
        assert_eq!(said(&mut found, "m", [1.0, 1.0, 5.0]), "it(kmh)");
        assert_eq!(said(&mut found, "m", [1.0, 5.0, 1.0]), "it_2(kmh)");
        assert_eq!(said(&mut found, "m", [1.0, 1.0, 5.0]), "it(kmh)", "one function for the same table");
        let functions: Vec<&str> = found.functions().collect();
        let first = "fn it(kmh: Ratio) -> Length = match kmh { 20 | 30 => 1 m, _ => 5 m }";
        let second = "fn it_2(kmh: Ratio) -> Length = match kmh { 20 | 40 => 1 m, _ => 5 m }";
        assert_eq!(functions, [first, second]);
    }

    #[test]
    fn two_points_are_a_multiple_or_no_line() {
        assert_eq!(line(&[(2.0, 1.0), (4.0, 2.0)], "", "x").as_deref(), Some("x * 0.5"));
        assert_eq!(line(&[(2.0, 1.0), (4.0, 3.0)], "", "x"), None);
        assert_eq!(line(&[(0.0, 1.0), (0.0, 1.0)], "", "x"), None);
    }
}

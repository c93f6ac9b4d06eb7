//! Texts that are large in one construct: each maker takes a size and gives a text in which that construct occurs so many
//! times, or is so deep or so long. They find work that grows faster than the text.
//!
//! Shared by the fuzz target `scale`, and by `tests/it/hostile.rs`, which runs the program on them and measures. A text
//! may use `roads.ava`; maps are made in `scaling_maps.rs`. Add a maker for each new rule of `grammar/ava.pest`.

/// A construct, and the text that has it `size` times.
pub struct Construct {
    pub name: &'static str,
    pub text: fn(usize) -> String,
}

const HEAD: &str = "language 1\n";
const ROADS: &str = "language 1\nuse \"roads.ava\"\n";
const BOOL: &str = "state b: Bool = true\n";
const COUNT: &str = "state c: Int = 0\n";
const ACTION: &str = "action a() { set b = false }\n";

/// The first numbers, each as the maker writes it.
fn each(count: usize, write: impl Fn(usize) -> String) -> String {
    (0..count).map(write).collect()
}

fn listed(count: usize, between: &str, write: impl Fn(usize) -> String) -> String {
    (0..count).map(write).collect::<Vec<_>>().join(between)
}

/// An enum `E` with as many variants as there may be.
fn largest_enum() -> String {
    format!("enum E = {}\n", listed(128, " | ", |i| format!("V{i}")))
}

/// Makers for the language, by construct.
pub const GRAMMAR: &[Construct] = &[
    Construct { name: "declarations", text: |n| HEAD.to_owned() + &each(n, |i| format!("let a{i} = {i}\n")) },
    Construct { name: "comments", text: |n| HEAD.to_owned() + &"/// a\n// b\n".repeat(n) },
    Construct { name: "mistakes", text: |n| HEAD.to_owned() + &"let ( = } \n".repeat(n) },
    Construct { name: "signs without a meaning", text: |n| HEAD.to_owned() + &"§ x y\n".repeat(n) },
    Construct { name: "one long line", text: |n| HEAD.to_owned() + &"let a = 1 ".repeat(n) + "\n" },
    Construct { name: "open texts", text: |n| HEAD.to_owned() + &"let a = \"".repeat(n) + "\n" },
    Construct {
        name: "uses of no file",
        text: |n| HEAD.to_owned() + &each(n, |i| format!("use \"{i}.ava\"\n")),
    },
    Construct { name: "uses of one file", text: |n| HEAD.to_owned() + &"use \"roads.ava\"\n".repeat(n) },
    Construct {
        name: "names left out",
        text: |n| format!("{HEAD}use \"roads.ava\" without {}\n", listed(n, ", ", |i| format!("x{i}"))),
    },
    Construct { name: "a long name", text: |n| format!("{HEAD}let {0} = 1\nlet b = {0}c\n", "a".repeat(n)) },
    Construct {
        name: "long unknown names",
        text: |n| HEAD.to_owned() + &each(n, |i| format!("let x{i} = {}\n", "a".repeat(500))),
    },
    Construct { name: "a long number", text: |n| format!("{HEAD}let a = {}\n", "9".repeat(n)) },
    Construct { name: "a sum", text: |n| format!("{HEAD}let a = 1{}\n", "+1".repeat(n)) },
    Construct { name: "signs before", text: |n| format!("{HEAD}let a = {}1\n", "-".repeat(n)) },
    Construct { name: "brackets", text: |n| format!("{HEAD}let a = {}1{}\n", "(".repeat(n), ")".repeat(n)) },
    Construct {
        name: "a list",
        text: |n| format!("{HEAD}let a = [{}]\n", listed(n, ", ", |i| i.to_string())),
    },
    Construct {
        name: "unknown names",
        text: |n| HEAD.to_owned() + &each(n, |i| format!("let a{i} = b{i}\n")),
    },
    Construct { name: "one name twice", text: |n| HEAD.to_owned() + &"let a = 1\n".repeat(n) },
    Construct {
        name: "constants in a chain",
        text: |n| format!("{HEAD}let a0 = 1\n{}", each(n, |i| format!("let a{} = a{i}\n", i + 1))),
    },
    Construct {
        name: "constants in a chain, the last first",
        text: |n| format!("{HEAD}{}let a{n} = 1\n", each(n, |i| format!("let a{i} = a{}\n", i + 1))),
    },
    Construct {
        name: "constants in a circle",
        text: |n| HEAD.to_owned() + &each(n, |i| format!("let a{i} = a{}\n", (i + 1) % n)),
    },
    Construct { name: "enums", text: |n| HEAD.to_owned() + &each(n, |i| format!("enum E{i} = A | B\n")) },
    Construct {
        name: "an ambiguous variant",
        text: |n| HEAD.to_owned() + &each(n, |i| format!("enum E{i} = A | B\nlet x{i} = A\n")),
    },
    Construct {
        name: "variants",
        text: |n| format!("{HEAD}enum E = {}\n", listed(n, " | ", |i| format!("V{i}"))),
    },
    Construct {
        name: "odds of variants",
        text: |n| {
            let lines = each(n, |i| format!("V{} => 1\n", i % 128));
            format!("{HEAD}{}odds E {{ {lines} }}\n", largest_enum())
        },
    },
    Construct {
        name: "odds of actions",
        text: |n| {
            let actions = each(n, |i| format!("action a{i}() {{ set b = true }}\n"));
            format!("{HEAD}{BOOL}{actions}odds actions {{ {} }}\n", each(n, |i| format!("a{i} => 2\n")))
        },
    },
    Construct {
        name: "cases of a number",
        text: |n| {
            format!(
                "{HEAD}fn f(x: Int) -> Int = match x {{ {}_ => 0 }}\n",
                each(n, |i| format!("{i} => 1\n"))
            )
        },
    },
    Construct {
        name: "cases of a number in a rule",
        text: |n| {
            let cases = each(n, |i| format!("{i} => 1\n"));
            format!("{ROADS}{COUNT}action a() {{ set c = 1 }}\nrule r: 0 <= match c {{ {cases}_ => 0 }}\n")
        },
    },
    Construct {
        name: "matches in the subject",
        text: |n| {
            let arms = " { true => false, false => true }".repeat(n);
            format!("{HEAD}fn f(x: Bool) -> Bool = {}x{arms}\n", "match ".repeat(n))
        },
    },
    Construct {
        name: "matches in arms for all variants",
        text: |n| {
            let depth = n.min(60);
            let open = "match e { V0 => 1, _ => ".repeat(depth);
            let used = "state s: E = any\naction a() { set s = V1 }\nrule r: f(s) >= 1\n";
            format!("{ROADS}{}fn f(e: E) -> Int = {open}2{}\n{used}", largest_enum(), " }".repeat(depth))
        },
    },
    Construct {
        name: "numbers matched in the subject",
        text: |n| {
            let subject = (0..n.min(60)).fold("x".to_owned(), |inner, _| {
                format!("match {inner} {{ 0 => 1, 1 => 2, 2 => 3, _ => 0 }}")
            });
            format!("{HEAD}fn f(x: Int) -> Int = {subject}\n")
        },
    },
    Construct {
        name: "functions that call one another twice",
        text: |n| {
            let calls = each(n, |i| format!("fn f{}(x: Int) -> Int = f{i}(x) + f{i}(x)\n", i + 1));
            format!("{HEAD}fn f0(x: Int) -> Int = x + x\n{calls}")
        },
    },
    Construct {
        name: "a function of itself",
        text: |n| {
            let depth = n.min(60);
            let called = format!("{}d{}", "f(".repeat(depth), ")".repeat(depth));
            let action = "action a(any d: Length in 1 m .. 2 m) { set b = d > 1 m }\n\
                          action z(any d: Length in 1 m .. 2 m) { set b = d > 1 m }\n";
            format!(
                "{ROADS}{BOOL}fn f(x: Length) -> Length = x + x - x\n{action}rule r on a, z: {called} <= 3 m\n"
            )
        },
    },
    Construct {
        name: "parameters of a function",
        text: |n| format!("{HEAD}fn f({}) -> Int = p0\n", listed(n, ", ", |i| format!("p{i}: Int"))),
    },
    Construct {
        name: "bodies",
        text: |n| {
            let bodies = each(n, |i| format!("body B{i} {{ like: Motorcycle, length: 1.8 m }}\n"));
            format!("{ROADS}{BOOL}{ACTION}{bodies}")
        },
    },
    Construct {
        name: "states",
        text: |n| {
            format!(
                "{ROADS}{}action a() {{ set s0 = false }}\n",
                each(n, |i| format!("state s{i}: Bool = true\n"))
            )
        },
    },
    Construct {
        name: "states with rules",
        text: |n| {
            let one = |i: usize| {
                let next = (i + 1) % n;
                format!(
                    "state s{i}: Bool = true\naction a{i}() {{ set s{i} = false }}\nrule r{i}: s{i} or s{next}\n"
                )
            };
            ROADS.to_owned() + &each(n, one)
        },
    },
    Construct {
        name: "drawn states with rules",
        text: |n| {
            let one = |i: usize| {
                let next = (i + 1) % n;
                format!(
                    "state s{i}: Bool = any\naction a{i}() {{ set s{i} = false }}\nrule r{i}: s{i} or s{next}\n"
                )
            };
            ROADS.to_owned() + &each(n, one)
        },
    },
    Construct {
        name: "states with rules about time",
        text: |n| {
            let one = |i: usize| {
                format!(
                    "state s{i}: Bool = true\naction a{i}() {{ set s{i} = false }}\nrule r{i}: s{i} or step >= 0\n"
                )
            };
            ROADS.to_owned() + &each(n, one)
        },
    },
    Construct {
        name: "states with transitions",
        text: |n| {
            let one = |i: usize| {
                let moves = "{ A -> A | B, B -> B | C, C -> C | A }";
                format!(
                    "state s{i}: T = any\naction a{i}(each e: T) {{ set s{i} = e }}\nrule r{i} on s{i} {moves}\n"
                )
            };
            format!("{ROADS}enum T = A | B | C\n{}", each(n, one))
        },
    },
    Construct {
        name: "maps of a drawn start",
        text: |n| {
            let n = n.min(128);
            let variants = listed(n, " | ", |i| format!("V{i}"));
            let states = "state s: E -> E = any\nstate t: E -> E = any\n";
            let action = "action a(each e: E) { set s[e] = e }\n";
            format!("{ROADS}enum E = {variants}\n{states}{action}rule r: s[V0] == t[V0]\n")
        },
    },
    Construct {
        name: "maps beside many rows",
        text: |n| {
            let states = each(n, |i| format!("state s{i}: E -> E = V0\n"));
            format!("{ROADS}{}{states}action a(each e: E, each f: E) {{ set s0[e] = f }}\n", largest_enum())
        },
    },
    Construct {
        name: "keys of a beginning",
        text: |n| {
            let keys = each(n, |i| format!("V{}: true\n", i % 128));
            format!("{HEAD}{}state s: E -> Bool = {{ {keys} }}\n", largest_enum())
        },
    },
    Construct {
        name: "actions",
        text: |n| format!("{ROADS}{BOOL}{}", each(n, |i| format!("action a{i}() {{ set b = false }}\n"))),
    },
    Construct {
        name: "actions that spawn",
        text: |n| {
            let spawn = "spawn Sedan ahead d { lane: Current, speed: 5 m/s, does: DriveAhead }";
            ROADS.to_owned()
                + &each(n, |i| format!("action a{i}(any d: Length in 30 m .. 50 m) {{ {spawn} }}\n"))
        },
    },
    Construct {
        name: "effects",
        text: |n| format!("{ROADS}{COUNT}action a() {{ {} }}\nrule r: c >= 0\n", "set c = c + c\n".repeat(n)),
    },
    Construct {
        name: "effects of one key",
        text: |n| {
            let sets = each(n, |i| format!("set s[V{}] = s[e]\n", i % 128));
            format!("{ROADS}{}state s: E -> Bool = true\naction a(each e: E) {{ {sets} }}\n", largest_enum())
        },
    },
    Construct {
        name: "spawns of one action",
        text: |n| {
            let spawn = "spawn Sedan ahead 30 m { lane: Current, speed: v, does: DriveAhead }\n".repeat(n);
            format!("{ROADS}action a(any v: Speed in 1 m/s .. 2 m/s) {{ {spawn} }}\n")
        },
    },
    Construct {
        name: "fields of a spawn",
        text: |n| {
            format!(
                "{HEAD}action a() {{ spawn Sedan ahead 30 m {{ {} }} }}\n",
                each(n, |i| format!("x{i}: 1\n"))
            )
        },
    },
    Construct {
        name: "rows",
        text: |n| {
            format!(
                "{ROADS}{COUNT}action a(each x: Int in 1 .. {n}) {{ set c = x }}\nrule r on a: x <= {n}\n"
            )
        },
    },
    Construct {
        name: "rows of a spawn",
        text: |n| {
            let spawn = "spawn Sedan ahead 50 m { lane: Current, speed: v, does: DriveAhead }";
            let drawn = "any v: Speed in 5 m/s .. 20 m/s";
            format!(
                "{ROADS}action a(each x: Int in 1 .. {n}, {drawn}) {{ {spawn} }}\nrule r on a: v <= road.limit\n"
            )
        },
    },
    Construct {
        name: "rows under a rule about the moment",
        text: |n| {
            let spawn = "spawn Sedan ahead 50 m { lane: Current, speed: v, does: DriveAhead }";
            let drawn = "any v: Speed in 5 m/s .. 20 m/s";
            let rule = "rule r on a: v <= ego.speed and ego.junction_ahead >= 20 m\n";
            format!("{ROADS}action a(each x: Int in 1 .. {n}, {drawn}) {{ {spawn} }}\n{rule}")
        },
    },
    Construct {
        name: "rows that a rule about the moment tells apart",
        text: |n| {
            let spawn = "spawn Sedan ahead 50 m { lane: Current, speed: v, does: DriveAhead }";
            let drawn = "any v: Speed in 5 m/s .. 20 m/s";
            let rule = "rule r on a: v <= ego.speed and ego.junction_ahead >= 20 m + x * 0.0001 m\n";
            format!("{ROADS}action a(each x: Int in 1 .. {n}, {drawn}) {{ {spawn} }}\n{rule}")
        },
    },
    Construct {
        name: "rows under three rules",
        text: |n| {
            let n = n.div_ceil(2);
            let spawn = "spawn Sedan ahead d { lane: Current, speed: v, does: DriveAhead }";
            let drawn = "any v: Speed in 5 m/s .. 20 m/s, any d: Length in 1 m .. 120 m";
            let gap =
                "fn gap(m: Mode, v: Speed) -> Length = match m { Near => 12 m, Far => 50 m } + v * 0.5 s\n";
            let rules = "rule r on a: v <= road.limit\nrule s on a: d == gap(m, v)\nrule t on a: x * 0.001 m <= d + 60 m\n";
            format!(
                "{ROADS}enum Mode = Near | Far\n{gap}action a(each x: Int in 1 .. {n}, each m: Mode, {drawn}) {{ {spawn} }}\n{rules}"
            )
        },
    },
    Construct {
        name: "axes of two values",
        text: |n| {
            format!(
                "{ROADS}{BOOL}action a({}) {{ set b = true }}\n",
                listed(n, ", ", |i| format!("each p{i}: Bool"))
            )
        },
    },
    Construct {
        name: "axes of one value",
        text: |n| {
            let axes = listed(n, ", ", |i| format!("each p{i}: Int in [1]"));
            format!("{ROADS}{BOOL}action a({axes}) {{ set b = true }}\n")
        },
    },
    Construct {
        name: "drawn lists",
        text: |n| {
            let drawn = format!("any x: Int in 1 .. {n}, any y: Int in 1 .. {n}");
            format!(
                "{ROADS}{COUNT}action a({drawn}) {{ set c = x + y }}\nrule r on a: x * y == 7919 * 7907\n"
            )
        },
    },
    Construct {
        name: "drawn truths that nothing fits",
        text: |n| {
            let n = n.clamp(2, 60);
            let drawn = listed(n, ", ", |i| format!("any x{i}: Bool"));
            let all = format!("{}x0{}", "(".repeat(n - 1), each(n - 1, |i| format!(" == x{})", i + 1)));
            format!(
                "{ROADS}{BOOL}action a({drawn}) {{ set b = x0 }}\nrule r on a: {all} == true\nrule s on a: {all} == false\n"
            )
        },
    },
    Construct {
        name: "drawn numbers",
        text: |n| {
            let drawn = listed(n, ", ", |i| format!("any x{i}: Length in 1 m .. 9 m"));
            let rules = each(n.saturating_sub(1), |i| format!("rule r{i} on a: x{i} <= x{}\n", i + 1));
            format!("{ROADS}{BOOL}action a({drawn}) {{ set b = x0 > 2 m }}\n{rules}")
        },
    },
    Construct {
        name: "groups that double",
        text: |n| {
            format!(
                "{HEAD}{BOOL}{ACTION}group g0 = a, a\n{}",
                each(n, |i| format!("group g{} = g{i}, g{i}\n", i + 1))
            )
        },
    },
    Construct {
        name: "groups of all actions",
        text: |n| {
            let actions = each(n, |i| format!("action a{i}() {{ set b = false }}\n"));
            format!("{HEAD}{BOOL}{actions}{}", each(n, |i| format!("group g{i} = actions\n")))
        },
    },
    Construct {
        name: "one name after `on`",
        text: |n| format!("{HEAD}{BOOL}{ACTION}rule r on a{}: b or not b\n", ", a".repeat(n)),
    },
    Construct {
        name: "rules on unknown actions",
        text: |n| {
            let actions = each(n, |i| format!("action a{i}() {{ set b = true }}\n"));
            format!("{HEAD}{BOOL}{actions}{}", each(n, |i| format!("rule r{i} on x{i}: b\n")))
        },
    },
    Construct {
        name: "rules on all actions",
        text: |n| {
            let actions = each(n, |i| format!("action a{i}() {{ set b = true }}\n"));
            format!(
                "{ROADS}{BOOL}{actions}{}",
                each(n, |i| format!("rule r{i} on actions: b or step >= {i}\n"))
            )
        },
    },
    Construct {
        name: "rules",
        text: |n| {
            let rules = each(n, |i| format!("rule r{i} on a: x <= {}\n", i + 10));
            format!("{ROADS}{COUNT}action a(each x: Int in 1 .. 10) {{ set c = x }}\n{rules}")
        },
    },
    Construct {
        name: "rules that oppose one another",
        text: |n| {
            let rules = each(n, |i| format!("rule r{i} on a: ego.speed + v >= nearest.speed + {i} m/s\n"));
            format!("{ROADS}{COUNT}action a(any v: Speed in 1 m/s .. 9 m/s) {{ set c = 1 }}\n{rules}")
        },
    },
    Construct {
        name: "rules about words",
        text: |n| {
            let rules = each(n, |i| format!("rule r{i} on a: ego.light in [Red, Green] or step >= {i}\n"));
            format!("{ROADS}{BOOL}{ACTION}{rules}")
        },
    },
    Construct {
        name: "rules about lane changes",
        text: |n| {
            let spawn = "spawn Sedan ahead 50 m { lane: Left, speed: v, does: DriveAhead, then: Change }";
            let rules = each(n, |i| format!("rule r{i} on a during change: npc.gap >= {} m\n", i % 50));
            format!("{ROADS}action a(any v: Speed in 5 m/s .. 9 m/s) {{ {spawn} }}\n{rules}")
        },
    },
    Construct {
        name: "optional rules",
        text: |n| {
            format!("{ROADS}{BOOL}{ACTION}{}", each(n, |i| format!("optional rule r{i}: b or not b\n")))
        },
    },
    Construct {
        name: "transitions",
        text: |n| {
            let moves = each(n, |i| format!("V{} -> V{}\n", i % 128, (i * 7 + i / 128) % 128));
            format!(
                "{ROADS}{}state s: E = any\naction a(each e: E) {{ set s = e }}\nrule r on s {{ {moves} }}\n",
                largest_enum()
            )
        },
    },
    Construct {
        name: "functions in rules",
        text: |n| {
            let calls = each(9, |i| format!("fn f{}(x: Int) -> Int = f{i}(x) + f{i}(x)\n", i + 1));
            let rules = each(n, |i| format!("rule r{i} on a: f9(x) >= {i} - 1\n"));
            let action = "action a(each x: Int in 1 .. 100) { set c = x }\n";
            format!("{ROADS}{COUNT}fn f0(x: Int) -> Int = x + x\n{calls}{action}{rules}")
        },
    },
    Construct {
        name: "more effects of all actions",
        text: |n| {
            let actions = each(n, |i| format!("action a{i}() {{ set b = true }}\n"));
            format!("{ROADS}{BOOL}{actions}on actions also {{ {} }}\n", "set b = true\n".repeat(n))
        },
    },
    Construct {
        name: "effects of each step",
        text: |n| {
            let states = each(n, |i| format!("state s{i}: Int = 0\n"));
            let sets = each(n, |i| format!("set s{i} = s{} + 1\n", (i + 1) % n));
            let rule = "rule r: elapsed >= 10 s implies s0 <= 300000\n";
            format!("{ROADS}{states}each step {{ {sets} }}\naction a() {{ set s0 = 0 }}\n{rule}")
        },
    },
    Construct {
        name: "roads",
        text: |n| {
            let fields = "start: lane 1/-2 at 10 m, goal: lane 1/-1 at 190 m";
            let roads = each(n, |i| format!("road q{i} {{ map: \"straight.xodr\", {fields} }}\n"));
            format!("{HEAD}{roads}{COUNT}action a(each x: Int in 1 .. 100) {{ set c = x }}\n")
        },
    },
    Construct {
        name: "roads of an episode",
        text: |n| {
            format!(
                "{ROADS}{BOOL}{ACTION}episode {{ roads: [{}] }}\n",
                listed(n, ", ", |_| "corner".to_owned())
            )
        },
    },
    Construct {
        name: "steps of an episode",
        text: |n| {
            let rule = "rule r: elapsed >= 1 s implies c <= 100000000\n";
            let step = "each step { set c = c + 1 }\n";
            format!(
                "{ROADS}{COUNT}action a() {{ set c = c + 1 }}\n{step}{rule}episode {{ limit: {n} steps }}\n"
            )
        },
    },
    Construct {
        name: "cases of the reward",
        text: |n| {
            format!(
                "{ROADS}{BOOL}{ACTION}reward {{ {}_ => 0 }}\n",
                each(n, |i| format!("proc > {i} % => {i}\n"))
            )
        },
    },
    Construct {
        name: "verdicts",
        text: |n| format!("{ROADS}{BOOL}{ACTION}{}", each(n, |i| format!("verdict v{i}: collision\n"))),
    },
    Construct {
        name: "claims",
        text: |n| {
            let action = "action a(each x: Int in 1 .. 300, each y: Int in 1 .. 100) { set c = x + y }\n";
            format!("{ROADS}{COUNT}{action}{}", "expect every(actions, realisable)\n".repeat(n))
        },
    },
    Construct {
        name: "overrides",
        text: |n| ROADS.to_owned() + &each(n, |i| format!("override let a{i} = 1\n")),
    },
    Construct { name: "steps of a scenario", text: |n| scenario(&each(n, |i| format!("{i}: wait()\n")), "") },
    Construct {
        name: "conditions of a scenario",
        text: |n| {
            scenario(&each(n, |i| format!("{i}: a() once npc#{}.gap <= 30 m after 0.5 s\n", i + 1)), "")
        },
    },
    Construct {
        name: "claims of a scenario",
        text: |n| scenario("0: wait()\n", &"expect end == arrived\n".repeat(n)),
    },
    Construct {
        name: "fields of a scenario",
        text: |n| scenario(&format!("0: a() with {{ {} }}\n", "mode: Far, ".repeat(n)), ""),
    },
    Construct {
        name: "lines of a policy",
        text: |n| {
            let lines = each(n, |i| format!("when dist_nearest <= {i} m => a()\n"));
            format!("{ROADS}{BOOL}{ACTION}policy p {{ rules {{ {lines} _ => a() }} }}\n")
        },
    },
    Construct {
        name: "rows of a policy's line",
        text: |n| format!("{ROADS}{BOOL}{ACTION}policy p {{ rules {{ _ => a(){} }} }}\n", " | a()".repeat(n)),
    },
];

fn scenario(steps: &str, claims: &str) -> String {
    format!("{ROADS}{BOOL}{ACTION}scenario s {{\nroad: corner\nsteps {{\n{steps}}}\n{claims}}}\n")
}

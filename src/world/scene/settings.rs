//! How settings are written down: each once, with default and range. Driving systems write theirs so, too.

/// A section of settings: its struct, its `Default` and the ranges of its numbers.
///
/// `name: type = default, low..=high;` is a number, `name: bool = default;` a switch.
#[macro_export]
macro_rules! section {
    (
        $(#[$about:meta])*
        pub struct $section:ident {
            $(
                $(#[$doc:meta])*
                $name:ident: $kind:ty = $default:expr $(, $low:literal..=$high:expr)?;
            )*
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $section {
            $($(#[$doc])* pub $name: $kind,)*
        }

        impl Default for $section {
            fn default() -> $section {
                $section { $($name: $default,)* }
            }
        }

        impl $section {
            /// Least and greatest value of every number.
            pub(crate) const RANGES: &[(&str, f64, f64)] =
                &[$($((stringify!($name), $low, $high),)?)*];
        }
    };
}

//! The declaration of a technique's parameters.

/// Declares a technique's struct with its parameters, each once: `ROWS` are its
/// [`Technique::PARAMETERS`](crate::technique::Technique). A parameter's comment is its help: a sentence, then
/// paragraphs for long help.
///
/// `field: Type = default, "flag" "VALUE" range, marks;`, or `field: Type = default => info;` for a parameter that
/// techniques share. Under `and` are fields that are no parameters.
#[doc(hidden)]
#[macro_export]
macro_rules! parameters {
    (
        $(#[$meta:meta])* pub struct $Technique:ident { $(
            $(#[doc = $help:literal])*
            $field:ident: $Type:ty = $default:expr
                $(, $flag:literal $value:literal $range:expr $(, $mark:ident)*)? $(=> $info:expr)?;
        )+ }
        $(and { $($(#[doc = $about:literal])* $own:ident: $Own:ty = $own_default:expr;)+ })?
    ) => {
        $(#[$meta])*
        pub struct $Technique {
            $($(#[doc = $help])* pub $field: $Type,)+
            $($($(#[doc = $about])* pub $own: $Own,)+)?
        }

        impl Default for $Technique {
            fn default() -> Self {
                Self::DEFAULT
            }
        }

        impl $Technique {
            /// The default.
            pub(crate) const DEFAULT: Self = Self { $($field: $default,)+ $($($own: $own_default,)+)? };
            /// The parameters.
            pub(crate) const ROWS: &'static [$crate::technique::Parameter<Self>] = &[$(
                $crate::parameters!(@row $field [$($help)*] $($flag $value $range $(, $mark)*)? $(=> $info)?),
            )+];
        }
    };
    (@row $field:ident [$($help:literal)*] $flag:literal $value:literal $range:expr $(, $mark:ident)*) => {
        $crate::technique::Parameter::new($flag, $value, $range, concat!($($help, "\n"),*), |s: &mut Self| &mut s.$field)
            $(.$mark())*
    };
    (@row $field:ident [$($help:literal)*] => $info:expr) => {
        $crate::technique::Parameter { info: $info, of: |s: &mut Self| &mut s.$field }
    };
}

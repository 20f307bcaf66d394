//! `#[derive(Explain)]` for error types: `#[explain("what is wrong", "what to do", ..)]` at a struct or at each variant
//! of an enum makes `Explain::explanation` and the `Display` that shows it in one line.
//!
//! A text may name fields in braces, those of a tuple as `{_0}`. In place of a text may stand an expression: a
//! `ErrorText`, a `String` or, for what to do, whatever has a `Display`. The derive is used through
//! `cft_ident_core::explain::Explain`, which shows an example.

use proc_macro::TokenStream;
use quote::{format_ident, quote};
use syn::punctuated::Punctuated;
use syn::{Attribute, Data, DeriveInput, Error, Expr, Fields, Token, parse_macro_input};

/// Derives `Explain` and `Display`.
#[proc_macro_derive(Explain, attributes(explain))]
pub fn explain(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    implementation(&input)
        .unwrap_or_else(Error::into_compile_error)
        .into()
}

fn implementation(input: &DeriveInput) -> Result<proc_macro2::TokenStream, Error> {
    let arms = match &input.data {
        Data::Struct(of) => vec![arm(&input.ident, None, &of.fields, &input.attrs)?],
        Data::Enum(of) => (of.variants.iter())
            .map(|v| arm(&v.ident, Some(&v.ident), &v.fields, &v.attrs))
            .collect::<Result<_, _>>()?,
        Data::Union(_) => return Err(Error::new_spanned(input, "a union is no error")),
    };
    let name = &input.ident;
    Ok(quote! {
        impl ::cft_ident_core::explain::Explain for #name {
            #[allow(unused_variables)]
            fn explanation(&self) -> ::cft_ident_core::explain::ErrorText {
                use ::cft_ident_core::explain::{Explain as _, ErrorText};
                match self { #(#arms)* }
            }
        }

        impl ::std::fmt::Display for #name {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                ::std::fmt::Display::fmt(&::cft_ident_core::explain::Explain::explanation(self), f)
            }
        }
    })
}

/// The arm of a variant, or of a struct.
fn arm(
    name: &syn::Ident,
    variant: Option<&syn::Ident>,
    fields: &Fields,
    attributes: &[Attribute],
) -> Result<proc_macro2::TokenStream, Error> {
    let of = variant.map(|variant| quote!(::#variant));
    let pattern = match fields {
        Fields::Named(fields) => {
            let names = fields.named.iter().map(|field| &field.ident);
            quote!(Self #of { #(#names),* })
        }
        Fields::Unnamed(fields) => {
            let names = (0..fields.unnamed.len()).map(|i| format_ident!("_{i}"));
            quote!(Self #of ( #(#names),* ))
        }
        Fields::Unit => quote!(Self #of),
    };
    let attribute = attributes.iter().find(|a| a.path().is_ident("explain"));
    let missing = || Error::new_spanned(name, "say what is wrong: #[explain(\"..\", \"..\")]");
    let texts = attribute.ok_or_else(missing)?;
    let texts = texts.parse_args_with(Punctuated::<Expr, Token![,]>::parse_terminated)?;
    let mut texts = texts.iter();
    let what = match texts.next().ok_or_else(missing)? {
        Expr::Lit(text) => quote!(ErrorText::new(format_args!(#text))),
        explanation => quote!(ErrorText::from(#explanation)),
    };
    let remedies = texts.map(|remedy| match remedy {
        Expr::Lit(text) => quote!(.remedy(format_args!(#text))),
        remedy => quote!(.remedy(#remedy)),
    });
    Ok(quote!(#pattern => #what #(#remedies)*,))
}

mod candidates;
mod range;
mod reference;
mod selection;

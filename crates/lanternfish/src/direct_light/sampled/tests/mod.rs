mod candidates;
mod reference;
mod selection;

"""What a block is - signals, one symbolic step, a declaration - and how it runs on arrays in this process."""

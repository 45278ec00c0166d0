"""Today's cores on recorded inputs: what would the robot have seen, believed and decided?"""

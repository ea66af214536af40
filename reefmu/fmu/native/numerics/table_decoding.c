/* Decoding of the lookup's tables.

   A table is stored as integer multiples of a quantum, differenced twice along the twist and once along the clearance.
   Codes are even for differences from zero up and odd for negative ones, and their bytes are stored in planes, the
   lowest bytes of all numbers first. reefmu/fmu/model/table_encoding.py writes them. */

static void decode(const uint32_t *words, int planes, const double *quanta, int blocks, int rows, int columns,
                   int layers, double *table) {
    int row_size = columns * layers;
    long count = (long)blocks * rows * row_size;
    for (int block = 0; block < blocks; block++)
        for (int inner = 0; inner < row_size; inner++) {
            int64_t value = 0, rise = 0;
            for (int row = 0; row < rows; row++) {
                long at = ((long)block * rows + row) * row_size + inner;
                uint64_t code = 0;
                for (int plane = 0; plane < planes; plane++) {
                    long byte = plane * count + at;
                    code |= (uint64_t)(words[byte / 4] >> 8 * (byte % 4) & 255u) << 8 * plane;
                }
                rise += code & 1 ? -(int64_t)(code / 2) - 1 : (int64_t)(code / 2);
                value += rise;
                /* Integer multiples of a power of two, so the sums are exact. */
                table[at] = (double)value * quanta[block] + (inner < layers ? 0.0 : table[at - layers]);
            }
        }
}

static void decode_tables(Tables *tables) {
#if !HAS_CONTACT_FUNCTION
    static const double quanta[] = LOOKUP_QUANTA;
    decode(LOOKUP_WORDS, LOOKUP_PLANES, quanta, LOOKUP_QUANTITIES, LOOKUP_ROWS, LOOKUP_COLUMNS, 1, tables->lookup);
#endif
#if HAS_ELEMENT
    {
        static const double quantum[] = {ELEMENT_QUANTUM};
        decode(ELEMENT_WORDS, ELEMENT_PLANES, quantum, 1, ELEMENT_ROWS, ELEMENT_COLUMNS, ELEMENT_LAYERS,
               tables->element);
    }
#endif
}
